"""Model of the albedo path: products of vertex colours and textures, and refusals."""

import re

import numpy as np
import pytest

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.texture import Texture

LENGTH = np.array([1, 2, 9, 300])


@pytest.mark.parametrize("colors", [True, False])
def test_colours_times_texels_of_two_materials(colors):
    """Two textures are compared with float64. With vertex colours the product adds a rounding of 2^-17."""
    rng = np.random.default_rng(2)
    images = [Texture(rng.random((8, 4, 3))), Texture(rng.random((2, 2, 3)), filter="nearest")]
    path = Albedo(colors, TextureSampler(TexelMemory(64)))
    loaded, material = path.texture.memory.load(images), np.array([0, 1, 1, 0])
    ends, count = [], len(LENGTH)
    for _ in range(2):
        places = np.where(material[:, np.newaxis], rng.uniform(0.1, 0.9, (count, 2)), rng.random((count, 2)))
        ends.append((rng.random((count, 3)), places))
    sides = np.array([(4, 8), (2, 2)])[material]
    weights = rng.uniform(0.5, 1, (2, count))
    given = [np.concatenate([color, uv * sides] if colors else [uv * sides], axis=1) for color, uv in ends]
    spans = SpanAttributes.quantise(path.spans, *given, LENGTH, weights, periodic=True)
    found = path.compute(spans, LENGTH, material, loaded.descriptors, loaded)
    span, index = pixels_of(LENGTH)
    far = index / np.maximum(LENGTH - 1, 1)[span]
    share = np.stack([(1 - far) * weights[0][span], far * weights[1][span]])[:, :, np.newaxis]
    color, uv = (sum(share[k] * ends[k][part][span] for k in (0, 1)) / share.sum(axis=0) for part in (0, 1))
    exact = color if colors else np.ones((len(span), 3))
    inner = np.ones(len(span), dtype=bool)
    for index, image in enumerate(images):
        own = material[span] == index
        exact[own] *= image.sample(uv[own], np.zeros(own.sum(), dtype=np.int64))
        if image.filter == "nearest":
            inner[own] = (np.abs(uv[own] * 2 - 1) > 1e-3).all(axis=1)
    # The bound has the rounding of texels, the rounding of shares times the contrast, and the rounding of the
    # product.
    assert np.abs(found.values - exact)[inner].max() < 2.0**-12 + 2.0**-13
    assert found.codes.max() <= 1 << 16


def test_white_times_white_is_one():
    path = Albedo(True, TextureSampler(TexelMemory(4)), perspective=False)
    white = Texture(np.ones((1, 1, 3)))
    loaded = path.texture.memory.load([white])
    ends = np.tile([1.0, 1, 1, 0.5, 0.5], (1, 1))
    spans = SpanAttributes.quantise(path.spans, ends, ends, np.array([5]))
    found = path.compute(spans, np.array([5]), np.array([0]), loaded.descriptors, loaded)
    assert (found.codes == 1 << 16).all()


def test_refused():
    with pytest.raises(ValueError, match=r"^an albedo needs vertex colours or textures$"):
        Albedo(colors=False)
    path = Albedo(False, TextureSampler(TexelMemory(4)), perspective=False)
    spans = SpanAttributes.quantise(path.spans, np.zeros((1, 2)), np.zeros((1, 2)), np.array([5]))
    text = "an albedo with textures needs texels and a texture of each material"
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        path.compute(spans, np.array([5]), np.array([0]))


@pytest.mark.parametrize(
    "words",
    [
        ("colors",),
        ("bilinear", "tinted"),
        ("nearest", "outside", "orthographic"),
        ("colors", "bilinear", "outside", "tinted", "orthographic"),
    ],
)
def test_words_describe_a_path(words):
    path = Albedo.of_parts(words)
    assert path.parts == words
    assert (path.colors, path.tints, path.perspective) == (
        "colors" in words,
        "tinted" in words,
        "orthographic" not in words,
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("tinted",), "there is no colour of a pixel; also give colors, nearest or bilinear"),
        (("nearest", "bilinear"), "a bilinear unit also serves nearest textures; leave out nearest"),
        (("colors", "outside"), "texels need textures; also give nearest or bilinear"),
    ],
)
def test_words_that_describe_none(words, says):
    with pytest.raises(ValueError, match=re.escape(says)):
        Albedo.of_parts(words)
