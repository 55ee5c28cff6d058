import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blysk.sim.errors import InputError
from blysk.sim.frames.picture import check_image_path, write_comparison, write_image

from ..cli.commandline import picture as read


def frames(height, width, seed=4):
    rng = np.random.default_rng(seed)
    golden = rng.random((height, width, 3))
    simulated = np.clip(np.rint(255 * golden) + rng.integers(-3, 4, golden.shape), 0, 255).astype(np.uint8)
    return simulated, golden


def find(picture, panel):
    """Row and column of every place where the panel stands in the picture, pixel for pixel."""
    height, width, _ = panel.shape
    rows, columns = np.nonzero((picture == panel[0, 0]).all(axis=2))
    return [
        (row, column)
        for row, column in zip(rows, columns, strict=True)
        if np.array_equal(picture[row : row + height, column : column + width], panel)
    ]


def in_rgb(path):
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def test_pixels_come_back_from_every_format_or_it_is_told(tmp_path):
    """Every format of Pillow is exact without a message, or names the largest change, or is refused."""
    Image.init()
    image, _ = frames(31, 300)
    held = {"AVIF", "BMP", "DDS", "DIB", "GIF", "JPEG", "JPEG2000", "PCX", "PNG", "PPM", "QOI", "SGI", "TGA"}
    held |= {"TIFF", "WEBP"}
    found = {}
    for suffix, name in Image.registered_extensions().items():
        path = tmp_path / f"a{suffix}"
        if name not in Image.SAVE:
            continue
        if name not in held:
            with pytest.raises(InputError, match=f"{name} does not hold a frame as it is; use .png, "):
                write_image(path, image)
            assert not path.exists()
            continue
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            write_image(path, image)
        off = np.abs(in_rgb(path).astype(int) - image).max()
        found[suffix] = off
        told = [f"{path}: {name} changes pixels, here by up to {off} LSB; .png keeps all of them"] * int(
            off > 0
        )
        assert [str(warning.message) for warning in caught] == told
    exact = {suffix for suffix, off in found.items() if off == 0}
    assert exact > {".png", ".bmp", ".ppm", ".tiff", ".tif", ".webp", ".tga"}
    assert found.keys() - exact >= {".jpg", ".jpeg", ".gif"}
    write_image(tmp_path / "A.PNG", image)
    assert np.array_equal(read(tmp_path / "A.PNG"), image)


def test_few_colours_come_back_from_gif(tmp_path):
    image = np.full((16, 16, 3), (200, 100, 50), dtype=np.uint8)
    write_image(tmp_path / "a.gif", image)
    assert np.array_equal(in_rgb(tmp_path / "a.gif"), image)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a.xyz", "the suffix .xyz is not a picture format"),
        ("a", "the name has no suffix"),
        ("a.fli", "the suffix .fli is not a picture format"),  # Pillow only reads this format.
    ],
)
def test_suffix(tmp_path, name, reason):
    image, golden = frames(4, 4)
    for attempt in (
        check_image_path,
        lambda path: write_image(path, image),
        lambda path: write_comparison(path, image, golden, title="t"),
    ):
        with pytest.raises(InputError) as caught:
            attempt(tmp_path / name)
        assert (
            str(caught.value)
            == f"{tmp_path / name}: {reason}; use .png, .webp, .tiff, .bmp, .ppm, or .jpg, which is not exact"
        )
    assert not list(tmp_path.iterdir())


def test_missing_folder(tmp_path):
    with pytest.raises(InputError, match="make the folder first"):
        check_image_path(tmp_path / "no" / "a.png")
    check_image_path(tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((4, 4, 3)),
        np.zeros((0, 4, 3), np.uint8),
    ],
)
def test_wrong_frame(tmp_path, image):
    with pytest.raises(ValueError, match="a frame must be uint8 of shape"):
        write_image(tmp_path / "a.png", image)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("height", "width"), [(1, 1), (16, 16), (37, 211), (300, 640), (3, 4095)])
def test_panels_are_the_frames(tmp_path, height, width):
    """Both frames stand in the picture unchanged, side by side. All text has a white border."""
    simulated, golden = frames(height, width)
    path = tmp_path / "a.png"
    write_comparison(path, simulated, golden, title="A title", subtitle="exponent 20")
    picture = read(path)
    rounded = np.floor(255 * golden + 0.5).astype(np.uint8)
    left, right = find(picture, simulated), find(picture, rounded)
    assert len(left) == len(right) == 1
    assert left[0][0] == right[0][0]
    assert right[0][1] >= left[0][1] + width
    for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert (edge == 255).all()
    assert (picture[: left[0][0]] < 128).any()


def test_error_map(tmp_path):
    """The colour of the map rises with the largest channel error, which is taken from the unrounded golden
    frame."""
    golden = np.full((16, 16, 3), 100.25 / 255)
    simulated = np.full((16, 16, 3), 100, dtype=np.uint8)
    simulated[:, 4:8, 0] = 102  # 1.75 LSB, in one channel
    simulated[:, 8:12, 1] = 97  # 3.25 LSB, below
    simulated[:, 12:] = 104  # 3.75 LSB, in all channels
    path = tmp_path / "a.png"
    write_comparison(path, simulated, golden, title="t")
    picture = read(path)
    [(row, start)] = find(picture, simulated)
    [(_, middle)] = [place for place in find(picture, np.full_like(simulated, 100)) if place[1] > start]
    third = 2 * middle - start
    panel = picture[row : row + 16, third : third + 16]
    bands = [panel[:, 4 * k : 4 * k + 4] for k in range(4)]
    assert all((band == band[0, 0]).all() for band in bands)
    # The scale below the map has the same colours at 0.25, 1.75, 3.25 of 3.75 and at its end.
    bar = next(
        line for line in picture[row + 20 :] if all((line == band[0, 0]).all(axis=1).any() for band in bands)
    )
    ink = np.flatnonzero((bar != 255).any(axis=1))
    found = [np.flatnonzero((bar == band[0, 0]).all(axis=1)).mean() for band in bands]
    share = (np.array(found) - ink[0]) / (ink[-1] - ink[0])
    # One of 256 colours is 1.2 pixels wide, and the frame of the bar one pixel.
    assert share == pytest.approx([0.25 / 3.75, 1.75 / 3.75, 3.25 / 3.75, 1], abs=0.01)


def test_equal_frames(tmp_path):
    """Without any error the scale ends at 1 LSB, and all of the map has the colour of 0."""
    simulated = np.full((16, 16, 3), 100, dtype=np.uint8)
    write_comparison(tmp_path / "a.png", simulated, simulated / 255.0, title="t")
    picture = read(tmp_path / "a.png")
    assert find(picture, np.broadcast_to(np.uint8([0, 0, 4]), (16, 16, 3)))


def test_titles_are_taken_as_they_are(tmp_path):
    simulated, golden = frames(8, 8)
    title = r"C:\new_model $k_s$ & 100 % " * 8
    write_comparison(tmp_path / "a.png", simulated, golden, title=title)
    picture = read(tmp_path / "a.png")
    assert (picture[:, :5] == 255).all()
    assert (picture[:, -5:] == 255).all()


def test_same_picture_twice(tmp_path):
    simulated, golden = frames(40, 60)
    for name in "ab":
        write_comparison(tmp_path / f"{name}.png", simulated, golden, title="t")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("golden", "text"),
    [
        (np.zeros((4, 5, 3)), "golden must be float64 of shape"),
        (np.zeros((4, 4, 3), np.float32), "golden must be float64 of shape"),
        (np.full((4, 4, 3), 1.01), "golden must be in"),
        (np.full((4, 4, 3), np.nan), "golden must be in"),
    ],
)
def test_wrong_golden(tmp_path, golden, text):
    with pytest.raises(ValueError, match=text):
        write_comparison(tmp_path / "a.png", np.zeros((4, 4, 3), np.uint8), golden, title="t")
    assert not list(tmp_path.iterdir())


def test_matplotlib_is_not_imported_before_it_is_needed():
    program = "import sys, blysk.sim.frames.picture; assert 'matplotlib' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[3], check=False)
    assert done.returncode == 0


@pytest.mark.parametrize("title", ["茶壶", "a\x07b", "\udced\udca0", "हिन्दी", "a$b_{"])
def test_a_title_that_the_font_lacks(tmp_path, title):
    """There is no warning of Matplotlib, which tests make an error, and no other warning."""
    simulated, golden = frames(6, 8)
    write_comparison(tmp_path / "a.png", simulated, golden, title=title)
    assert read(tmp_path / "a.png").size
