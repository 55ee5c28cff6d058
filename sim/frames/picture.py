"""Frames as picture files, and a simulated frame beside the golden frame."""

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from blysk.golden.reference.metrics import error_map
from blysk.golden.reference.transfer import SPACES
from blysk.sim.errors import InputError
from blysk.sim.output import atomic_writer, check_writable
from blysk.sim.run_files import MARK

__all__ = ["check_image_path", "write_comparison", "write_image"]

_COMMON = ".png, .webp, .tiff, .bmp, .ppm, or .jpg, which is not exact"
_EXACT: dict[str, dict[str, Any]] = {
    **{name: {} for name in ("BMP", "DDS", "DIB", "JPEG2000", "PCX", "PPM", "QOI", "SGI", "TGA", "TIFF")},
    "PNG": {},
    "WEBP": {"lossless": True, "exact": True},
}
"""Formats that keep every pixel, with Pillow's options for this."""

_LOSSY: dict[str, dict[str, Any]] = {
    "AVIF": {"quality": 100, "subsampling": "4:4:4"},
    "GIF": {"comment": MARK},
    "JPEG": {"quality": 95, "subsampling": "4:4:4"},
}
"""Formats that change pixels, with options that keep the change small. A warning gives the change."""

_COLOR_MAP = "inferno"


def check_image_path(path: str | os.PathLike) -> None:
    """Check, before long work, that a picture can be written to a file. The check leaves nothing behind.

    Raises
    ------
    InputError
        If the suffix names no picture format, or the file cannot be written (see `check_writable`).
    """
    _picture_format(path)
    check_writable(path)


def _picture_format(path: str | os.PathLike) -> str:
    suffix = Path(path).suffix.lower()
    name = Image.registered_extensions().get(suffix)
    if name not in Image.SAVE or name not in {**_EXACT, **_LOSSY}:
        reason = f"the suffix {suffix} is not a picture format" if suffix else "the name has no suffix"
        if name in Image.SAVE:
            reason = f"{name} does not hold a frame as it is"
        raise InputError(str(path), reason, f"use {_COMMON}")
    return name


def write_image(path: str | os.PathLike, image: np.ndarray) -> None:
    """Write a frame as a picture in the format of the suffix. The file is whole or not there at all.

    PNG, WebP, TIFF, BMP, PPM, TGA, QOI, JPEG 2000, PCX, SGI and DDS keep every pixel to the bit. JPEG, AVIF
    and GIF may change pixels. A ``RuntimeWarning`` then gives the largest error of a channel in the file.

    Parameters
    ----------
    path : path
        The output file, with a suffix that Pillow can write.
    image : uint8 array, shape (height, width, 3)
        Red, green, blue. Row 0 is at the top.

    Raises
    ------
    InputError
        If the suffix names no picture format, or the file cannot be written.
    ValueError
        If the image has another shape or type.
    """
    _check_frame(image)
    name = _picture_format(path)
    options = _EXACT.get(name) or _LOSSY.get(name) or {}
    if name == "PNG":
        options = {"pnginfo": PngInfo()}
        options["pnginfo"].add_text("Software", MARK)
    with atomic_writer(path) as temporary:
        Image.fromarray(image).save(temporary, format=name, **options)
        if name in _LOSSY and temporary.is_file():
            with Image.open(temporary) as kept:
                off = np.abs(np.asarray(kept.convert("RGB")).astype(int) - image).max()
            if off:
                text = f"{path}: {name} changes pixels, here by up to {off} LSB; .png keeps all of them"
                warnings.warn(text, RuntimeWarning, stacklevel=2)


def write_comparison(
    path: str | os.PathLike,
    simulated: np.ndarray,
    golden: np.ndarray,
    *,
    title: str,
    subtitle: str = "",
    transfer: str = "linear",
) -> None:
    """Write one picture of three panels: simulated frame, golden frame, and error map with its scale.

    The error of a pixel is the largest of its three channels' ``|simulated - 255 golden|``, in units of the
    last place (LSB) of the 8-bit channel. The golden frame is not rounded for this, so rounding alone makes
    an error of up to half an LSB. The golden panel shows ``round(255 golden)``. The scale of the map goes
    from 0 to the largest error, and at least to 1 LSB.

    The panels show the frames pixel for pixel, from 1 x 1 to 4095 x 4095 and beyond. The text grows with the
    frame's width, from 14 to 96 pixels. The margins widen if a small frame or a long title needs more room.
    The picture of a frame of 4095 x 4095 is 12,700 pixels wide.

    Parameters
    ----------
    path : path
        The output file, with a suffix that Pillow can write.
    simulated : uint8 array, shape (height, width, 3)
        Frame of the simulated hardware.
    golden : float64 array, shape (height, width, 3)
        Frame of the golden renderer, in [0, 1], encoded as the simulated frame.
    title, subtitle : str
        One line each, above the panels.
    transfer : str
        Transfer of both frames, for the label of the errors' scale.

    Raises
    ------
    InputError
        If the suffix names no picture format, or the file cannot be written.
    ValueError
        If a frame has another shape or type, or a value of ``golden`` is outside [0, 1].
    """
    _check_frame(simulated)
    if golden.shape != simulated.shape or golden.dtype != np.float64:
        raise ValueError(
            f"golden must be float64 of shape {simulated.shape}, not {golden.dtype} of shape {golden.shape}"
        )
    if not (golden.min() >= 0 and golden.max() <= 1):
        raise ValueError("golden must be in [0, 1]")
    check_image_path(path)

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    height, width, _ = simulated.shape
    panels, largest = _panels(simulated, golden)
    text = int(np.clip(width / 40, 14, 96))
    column = max(width, 22 * text)
    total_width = max(3 * column + 4 * text, int(0.65 * 1.3 * text * max(len(title), len(subtitle))))
    left = [(total_width - 3 * column - 2 * text) // 2 + k * (column + text) for k in range(3)]
    above, below = 7 * text, 5 * text
    # The figure has the texts above and below the panels. The panels are copied between the texts unchanged.
    # At 72 dots an inch, a point is a pixel. Half a pixel is added, so that the size is not rounded down.
    figure = Figure(figsize=((total_width + 0.5) / 72, (above + below + 0.5) / 72), dpi=72)
    canvas = FigureCanvasAgg(figure)

    def place(x: float, y: float, content: str, **options):
        content = _drawable(content, options.get("weight", "normal"))
        figure.text(
            x / total_width, 1 - y / (above + below), content, parse_math=False, ha="center", **options
        )

    place(total_width / 2, 2.2 * text, title, fontsize=1.3 * text, weight="bold")
    place(total_width / 2, 4 * text, subtitle, fontsize=text)
    for x, label in zip(left, panels, strict=True):
        place(x + column / 2, above - 0.6 * text, label, fontsize=text)
    bar = figure.add_axes(
        [left[2] / total_width, 3.4 * text / (above + below), column / total_width, text / (above + below)]
    )
    scale = figure.colorbar(
        ScalarMappable(Normalize(0, largest), _COLOR_MAP), cax=bar, orientation="horizontal"
    )
    scale.ax.tick_params(labelsize=text, length=text / 3, width=text / 14, pad=text / 5)
    scale.set_label(f"largest channel error, LSB of 8-bit {SPACES[transfer]}", fontsize=text)
    canvas.draw()
    around = np.asarray(canvas.buffer_rgba())[..., :3]

    picture = np.full((above + height + below, total_width, 3), 255, dtype=np.uint8)
    picture[:above] = around[:above]
    picture[above + height :] = around[above:]
    for x, panel in zip(left, panels.values(), strict=True):
        x += (column - width) // 2
        picture[above : above + height, x : x + width] = panel
    write_image(path, picture)


def _drawable(text: str, weight: str) -> str:
    """A text with ``?`` for characters that Matplotlib's font lacks, such as letters of a file's name."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    known = get_font(findfont(FontProperties(weight=weight))).get_charmap()
    return "".join(letter if ord(letter) in known else "?" for letter in text)


def _panels(simulated: np.ndarray, golden: np.ndarray) -> tuple[dict[str, np.ndarray], float]:
    """Panels of a comparison by their labels, and the end of the error map's scale in LSB."""
    import matplotlib

    error = error_map(simulated, golden)
    rounded = np.empty_like(simulated)
    for channel in range(3):
        rounded[..., channel] = np.rint(255 * golden[..., channel])
    largest = max(1.0, error.max())
    colors = (matplotlib.colormaps[_COLOR_MAP](np.arange(256))[:, :3] * 255).round().astype(np.uint8)
    return {
        "simulated": simulated,
        "golden": rounded,
        f"error: largest {error.max():.2f}, mean {error.mean():.3f} LSB": colors[
            np.rint(error * (255 / largest)).astype(np.uint8)
        ],
    }, largest


def _check_frame(image: np.ndarray) -> None:
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise ValueError(
            f"a frame must be uint8 of shape (height, width, 3), not {image.dtype} of shape {image.shape}"
        )
