"""Images of mesh files as textures in linear light."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from blysk.golden.reference.texture import LARGEST_TEXTURE
from blysk.sim.meshes.images import MAX_PIXELS, load_texture
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.refusal import Refused

# Codes and their linear light, computed by the curve of IEC 61966-2-1 with other tools.
LINEAR = {0: 0.0, 1: 0.000303527, 51: 0.0331048, 128: 0.2158605, 188: 0.5028865, 255: 1.0}


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(rows, color, depth=8, before=b"", size=None):
    """A PNG file of rows of bytes, written by hand."""
    height, width = size or (len(rows), len(rows[0]) // {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[color] * 8 // depth)
    head = struct.pack(">2I5B", width, height, depth, color, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    chunks = chunk(b"IHDR", head) + before + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def saved(image, kind, **options):
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


def read(data, name="a.png", **options):
    """The texture, and what is told. No warning may appear."""
    found = Found()
    return load_texture(data, name, found, **options), found.ignored


PALETTE = chunk(b"PLTE", bytes([51, 128, 188, 255, 0, 1]))
RGB = [[51, 128, 188], [255, 0, 1]]
GREY = [[51] * 3, [128] * 3]


@pytest.mark.parametrize(
    ("data", "expected", "told"),
    [
        (png([[51, 128]], 0), GREY, ()),
        (png([[0b10000000]], 0, 1, size=(1, 2)), [[255] * 3, [0] * 3], ()),
        (png([[51, 255, 128, 255]], 4), GREY, ()),
        (png([[51, 255, 128, 254]], 4), GREY, ("alpha of images: a.png",)),
        (png([[51, 128, 188, 255, 0, 1]], 2), RGB, ()),
        (png([[51, 128, 188, 255, 255, 0, 1, 0]], 6), RGB, ("alpha of images: a.png",)),
        (png([[0, 1]], 3, before=PALETTE), RGB, ()),
        (png([[0b00000001]], 3, 4, PALETTE, (1, 2)), RGB, ()),
        (png([[0, 1]], 3, before=PALETTE + chunk(b"tRNS", b"\x07")), RGB, ("alpha of images: a.png",)),
        (
            png([[51, 128, 188, 255, 0, 1]], 2, before=chunk(b"tRNS", struct.pack(">3H", 255, 0, 1))),
            RGB,
            ("alpha of images: a.png",),
        ),
        # A profile and a curve in the file have no effect.
        (
            png([[51, 128]], 0, before=chunk(b"iCCP", b"x\0\0" + zlib.compress(b"damaged"))),
            GREY,
            (),
        ),
        (png([[51, 128]], 0, before=chunk(b"gAMA", struct.pack(">I", 100000))), GREY, ()),
    ],
)
def test_each_kind_of_png_is_read(data, expected, told):
    texture, ignored = read(data)
    assert np.allclose(texture.texels[0], [[LINEAR[code] for code in row] for row in expected], atol=5e-7)
    assert ignored == told


def test_alpha_that_is_read_is_no_news():
    texture, told = read(png([[51, 255, 128, 254]], 4), alpha=True)
    assert (texture.alpha.tolist(), told) == ([[1, 254 / 255]], ())
    assert read(png([[51, 255, 128, 255]], 4), alpha=True)[0].alpha.size == 0


@pytest.mark.parametrize("kind", ["BMP", "TGA", "WEBP"])
def test_other_kinds_are_read(kind):
    image = Image.fromarray(np.array([RGB], np.uint8))
    texture, ignored = read(saved(image, kind, **({"lossless": True} if kind == "WEBP" else {})))
    assert np.allclose(texture.texels[0], [[LINEAR[code] for code in row] for row in RGB], atol=5e-7)
    assert ignored == ()


def test_jpeg_is_read_and_its_orientation_does_not_count():
    exif = Image.Exif()
    exif[0x0112] = 6
    pixels = np.full((8, 16, 3), 128, np.uint8)
    pixels[:, 8:] = 51
    texture, _ = read(saved(Image.fromarray(pixels), "JPEG", quality=100, subsampling=0, exif=exif))
    assert texture.texels.shape == (8, 16, 3)
    # JPEG rounds twice, by a code or two.
    assert np.abs(texture.texels[:, 2] - LINEAR[128]).max() < 0.02
    assert np.abs(texture.texels[:, 13] - LINEAR[51]).max() < 0.01
    grey, _ = read(saved(Image.fromarray(pixels[..., 0]), "JPEG", quality=100))
    assert np.abs(grey.texels[:, 2] - LINEAR[128]).max() < 0.02


def test_sampling_is_passed_on():
    texture, _ = read(png([[51, 128]], 0), wrap=("clamp", "mirror"), filter="nearest", mipmapped=False)
    assert (texture.wrap, texture.filter, texture.mipmapped) == (("clamp", "mirror"), "nearest", False)


@pytest.mark.parametrize(
    ("width", "height", "to"),
    [
        (3, 5, (4, 4)),
        (5, 11, (4, 8)),
        (6, 1, (8, 1)),
        (12, 23, (16, 32)),
        (2048, 1, (1024, 1)),
        (1500, 2, (1024, 2)),
    ],
)
def test_other_sizes_are_resampled_and_told(width, height, to):
    texture, ignored = read(saved(Image.new("RGB", (width, height), (51, 128, 188)), "PNG"), "wood.png")
    assert texture.texels.shape == (to[1], to[0], 3)
    assert np.allclose(texture.texels, [LINEAR[51], LINEAR[128], LINEAR[188]], atol=1e-6)
    assert ignored == (f"sizes of images: {width} x {height} (resampled to {to[0]} x {to[1]}) of wood.png",)


def test_resampling_is_in_linear_light_and_follows_the_wrap():
    # Black and white, halved, are half of the light, not code 128.
    row = np.zeros((1, 2 * LARGEST_TEXTURE), np.uint8)
    row[:, ::2] = 255
    texture, _ = read(saved(Image.fromarray(row), "PNG"))
    assert np.allclose(texture.texels, 0.5, atol=1e-6)
    # Three texels become four. The first new centre, 1/8, is a twenty-fourth before the first old centre.
    data = png([[0, 0, 255]], 0)
    for wrap, share in (("repeat", 0.125), ("clamp", 0), ("mirror", 0)):
        texture, _ = read(data, wrap=(wrap, "repeat"))
        assert np.allclose(texture.texels[0, 0], share, atol=1e-6)
    texture, _ = read(data, filter="nearest")
    assert set(np.unique(texture.texels)) == {0, 1}


WHOLE = png([[0, 60, 120, 180] * 16] * 64, 0)
BROKEN = bytearray(WHOLE)
BROKEN[60] ^= 1


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "is empty"),
        (b"not an image at all", "none of the kinds PNG, JPEG, WEBP, BMP, TGA"),
        (b"GIF89a\1\0\1\0", "none of the kinds"),
        (WHOLE[:20], "damaged"),
        (WHOLE[:70], "damaged"),
        (bytes(BROKEN), "damaged"),
        (WHOLE[:-12], "damaged"),
        (saved(Image.effect_noise((64, 64), 50), "JPEG")[:700], "damaged"),
        (png([[0]], 0, size=(1 << 15, 1 << 15)), "over 67,108,864 pixels"),
        (png([[0]], 0, size=(1, MAX_PIXELS + 1)), "over 67,108,864 pixels"),
        (png([[0]], 0, size=(10000, 10000)), "over 67,108,864 pixels"),
        (png([[0]], 0, size=(0, 1)), "damaged"),
        (png([[0]], 0, size=(8, 8)), "damaged"),
        (png([[0, 1]], 0, 16), "16 bits a channel"),
        (png([[0, 1] * 3], 2, 16, size=(1, 1)), "16 bits a channel"),
        (png([[0, 1] * 4], 6, 16, size=(1, 1)), "16 bits a channel"),
        (saved(Image.new("CMYK", (2, 2)), "JPEG"), "colours of the kind CMYK"),
        (png([[5]], 3, before=b""), "damaged"),
        (png([[0]], 0, 5, size=(1, 1)), "damaged"),
    ],
)
def test_bad_images_are_refused_in_a_line(data, reason):
    with pytest.raises(Refused) as refusal:
        read(data, "a\nb.png")
    assert "its image 'a?b.png'" in refusal.value.reason
    assert reason in refusal.value.reason
    assert "\n" not in refusal.value.reason
    assert "Error" not in refusal.value.reason
    assert "()" not in refusal.value.reason
