"""Images of mesh files: from the bytes of a picture file to a texture in linear light."""

import io
import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from blysk.golden.reference.texture import LARGEST_TEXTURE, Texture
from blysk.golden.reference.transfer import decode
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.refusal import Refused, inside, shown
from blysk.sim.run_files import reads

__all__ = ["MAX_PIXELS", "NOT_THERE", "OUTSIDE", "find_image", "load_texture", "read_texture"]

MAX_PIXELS = 1 << 26
"""Largest number of pixels of an image, 8192 x 8192."""

NOT_THERE, OUTSIDE = "which does not exist", "outside its folder"
"""Reasons for which a file beside a mesh file is not read."""

_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA")
_REMEDY = "save the image again, as PNG or JPEG, or shade the mesh with one material"
_PADS = {"repeat": "wrap", "mirror": "symmetric", "clamp": "edge"}


def load_texture(
    data: bytes,
    name: str,
    found: Found,
    *,
    wrap: tuple[str, str] = ("repeat", "repeat"),
    filter: str = "bilinear",
    mipmapped: bool = True,
    alpha: bool = False,
) -> Texture:
    """Texture of an image: PNG, JPEG, WebP, BMP or TGA.

    Codes of 8 bits are decoded by the curve of sRGB. Colour profiles and orientations (EXIF) are not read.

    A side that is no power of two, or over `LARGEST_TEXTURE`, is resampled in linear light. Its new size is
    the power of two with the nearest logarithm. The sizes of resampled images, and frames after the first are
    recorded as not read.

    Parameters
    ----------
    data : bytes
        The picture file.
    name : str
        Its name in messages.
    found : Found
        Records contents that are not read.
    wrap, filter, mipmapped
        See `Texture`. The texels that a resampled border needs follow from ``wrap``. An image for ``nearest``
        is enlarged without mixing the colours of neighbours.
    alpha : bool
        Whether alpha is read. If not, it is recorded as not read. Alpha is linear. It is resampled like a
        colour.

    Raises
    ------
    Refused
        In one of these cases:

        - the data are empty, cut short, damaged or no image of these kinds;
        - the image has no pixels, or more than `MAX_PIXELS`;
        - it has 16 bits a channel, or channels other than grey, red, green, blue and alpha.
    """
    what = f"its image {shown(name)!r}"
    if not data:
        raise Refused(f"{what} is empty", _REMEDY)
    image, unread = _decoded(data, what)
    for kind in unread:
        if not (kind == "alpha" and alpha):
            found.tell_names(f"{kind} of images", [name])
    size = tuple(min(1 << round(float(np.log2(side))), LARGEST_TEXTURE) for side in image.size)
    curves = dict.fromkeys("RGB", decode(np.arange(256) / 255))
    if alpha and "alpha" in unread:
        curves["A"] = np.arange(256) / 255
    channels = {c: np.asarray(image.getchannel(c)) for c in curves}
    if image.size == size:
        planes = {c: curves[c][codes] for c, codes in channels.items()}
    else:
        planes = {c: _resampled(codes, curves[c], size, wrap, filter) for c, codes in channels.items()}
        of, to = (f"{width} x {height}" for width, height in (image.size, size))
        found.tell_names("sizes of images", [f"{of} (resampled to {to}) of {name}"])
    texels = np.stack([planes[c] for c in "RGB"], axis=-1)
    return Texture(texels, wrap, filter, mipmapped, planes.get("A", np.zeros((0, 0))))


def find_image(name: str, folder: Path, beside: Path | None = None) -> tuple[Path | None, str]:
    """The file of an image that a mesh file, or a file beside it, names.

    If a name has folders, perhaps those of another machine, its last part is looked for, too. A comment
    after ``#`` may follow a name.

    Parameters
    ----------
    name : str
        The name. Folders are parted by ``/`` or ``\\``.
    folder : Path
        Folder of the mesh file, which holds the image or a folder of the image.
    beside : Path, optional
        Folder of the file that names the image, looked at first.

    Returns
    -------
    tuple of Path or None, and str
        The file and an empty text. If there is no file: ``None``, and `NOT_THERE` or `OUTSIDE`.
    """
    plain = name.strip().strip('"').replace("\\", "/")
    bare = plain.partition(" #")[0].strip()
    reason = NOT_THERE
    for part in dict.fromkeys([plain, bare, bare.rpartition("/")[2]]):
        for place in dict.fromkeys([beside or folder, folder]):
            try:
                target = inside(folder, part, os.path.relpath(place / part, folder))
                if os.path.isfile(target):
                    return target, ""
            except (Refused, ValueError, OSError):
                reason = OUTSIDE if part == bare else reason
    return None, reason


def read_texture(path: Path, found: Found, name: str | None = None, **options: Any) -> Texture:
    """Texture of a file; ``options`` are those of `load_texture`. By default ``name`` is the file's name."""
    reads(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        reason = f"its image {shown(path.name)!r} cannot be opened ({error.strerror})"
        raise Refused(reason, _REMEDY) from error
    return load_texture(data, path.name if name is None else name, found, **options)


def _decoded(data: bytes, what: str) -> tuple[Image.Image, list[str]]:
    """The image as RGB or RGBA, and the contents that are not read. The user sees no warnings of Pillow."""
    unread = []
    kinds = ", ".join(_FORMATS)
    many = Refused(f"{what} has over {MAX_PIXELS:,} pixels", _REMEDY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            image = Image.open(io.BytesIO(data), formats=_FORMATS)
            width, height = image.size
            if width * height > MAX_PIXELS:
                raise many
            if not width * height:
                raise Refused(f"{what} has no pixels", _REMEDY)
            if image.format == "PNG" and data[24] == 16:
                raise Refused(f"{what} has 16 bits a channel, and only 8 are read", _REMEDY)
            if image.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA"):
                raise Refused(f"{what} has colours of the kind {image.mode}, not RGB", _REMEDY)
            # This reads the checksums. Afterwards the image has to be opened again.
            image.verify()
            image = Image.open(io.BytesIO(data), formats=_FORMATS)
            if getattr(image, "n_frames", 1) > 1:
                unread.append("frames after the first")
            if not image.has_transparency_data:
                return image.convert("RGB"), unread
            image = image.convert("RGBA")
            if image.getchannel("A").getextrema()[0] < 255:
                unread.append("alpha")
            return image, unread
        except Refused:
            raise
        except (Image.DecompressionBombWarning, Image.DecompressionBombError):
            raise many from None
        except UnidentifiedImageError:
            raise Refused(f"{what} is damaged, or none of the kinds {kinds}", _REMEDY) from None
        # A damaged image may make Pillow raise any exception.
        except Exception as error:
            said = f" ({shown(str(error))})" if str(error) else ""
            raise Refused(f"{what} is damaged{said}", _REMEDY) from error


def _resampled(
    channel: np.ndarray, light: np.ndarray, size: tuple[int, ...], wrap: tuple[str, str], filter: str
) -> np.ndarray:
    """A channel of codes, resampled in linear light. If sizes have a whole ratio, texels become means."""
    old = channel.shape[::-1]
    # The margin has twice as many texels as a filter reaches beyond the border.
    pad = [2 + 2 * -(-before // after) for before, after in zip(old, size, strict=True)]
    for axis, count, mode in zip((1, 0), pad, wrap, strict=True):
        counts = [(0, 0), (0, 0)]
        counts[axis] = (count, count)
        channel = np.pad(channel, counts, mode=_PADS[mode])
    whole = all(before % after == 0 for before, after in zip(old, size, strict=True))
    kind = Image.Resampling.BOX if whole or filter == "nearest" else Image.Resampling.BILINEAR
    box = (pad[0], pad[1], pad[0] + old[0], pad[1] + old[1])
    made = Image.fromarray(light.astype(np.float32)[channel]).resize(size, kind, box)
    return np.clip(np.asarray(made, dtype=np.float64), 0, 1)
