"""The local chord method: operands of pixels with L and H of their own, against float64 mathematics."""

import numpy as np
import pytest

from blysk.bench.units.methods.local_chord_interpolator import mixed_lengths
from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.fixed import SQ
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE, ONE_SQUARED
from blysk.golden.reference.geometry import normalise

ONE_VALUE = float(ONE_SQUARED.values)
METHOD = LocalChordInterpolator()


class Surface:
    """Straight lines of points with turning normals, lit by point lights and seen by a near viewer."""

    def __init__(self, rng, count, lights, turn, reach, exponent):
        self.start = rng.normal(size=(count, 3))
        self.step = reach * normalise(rng.normal(size=(count, 3)))
        # These lights are at about 3 units, on all sides.
        self.lights = rng.uniform(2, 4, (count, lights, 1)) * normalise(rng.normal(size=(count, lights, 3)))
        self.viewer = rng.uniform(2, 4, (count, 1)) * normalise(rng.normal(size=(count, 3)))
        # These normals are about the H of the first light, so half of the spans have its highlight.
        towards = normalise(normalise(self.lights[:, 0]) + normalise(self.viewer))
        near = rng.normal(size=(count, 3)) * rng.choice([0.5, 2, 30], (count, 1)) / np.sqrt(exponent)
        self.left = normalise(towards + near)
        self.right = normalise(self.left + turn * normalise(rng.normal(size=(count, 3))))

    def at(self, span, t):
        """N·L and 1 - N·H at places of spans, with each vector normalised at the place."""
        t = t[:, np.newaxis]
        normal = normalise((1 - t) * self.left[span] + t * self.right[span])[:, np.newaxis]
        point = self.start[span] + t * self.step[span]
        viewer = normalise(self.start[span] + self.viewer[span] - point)[:, np.newaxis]
        direction = normalise((self.start[span])[:, np.newaxis] + self.lights[span] - point[:, np.newaxis])
        halfway = normalise(direction + viewer)
        return (normal * direction).sum(axis=2), ((normal - halfway) ** 2).sum(axis=2) / 2

    def values(self):
        span = np.arange(len(self.start))
        each = [self.at(span, np.full(len(span), t)) for t in (0.0, 0.5, 1.0)]
        return SpanValues.quantise(*(np.stack(value, axis=2) for value in zip(*each, strict=True)))


def test_operands():
    """Operands are within the bounds of the setup and the last rounding of the quadratics through the exact
    values."""
    rng = np.random.default_rng(1)
    surface = Surface(rng, 4000, 2, 0.1, 0.1, 20)
    length = rng.integers(1, 400, 4000)
    values = surface.values()
    operands = METHOD.compute_values(values, length)
    # If a light is nearly opposite to the viewer, H turns a great deal.
    assert operands.out_of_range.mean() < 0.01
    kept = ~operands.out_of_range[pixels_of(length)[0]]
    assert operands.cosine.format == METHOD.COSINE_FORMAT == SQ(2, 25)
    assert operands.highlight.format == Specular(operand=METHOD.operand).operand_format
    assert operands.cosine.codes.shape == operands.highlight.codes.shape == (length.sum(), 2)
    p, step = METHOD.setup, 2.0**-26
    cosine, u = METHOD.exact_operands(values, length)
    # A quadratic may be under 0, and the operand may not.
    assert u.min() < 0
    found = cosine, np.maximum(u, 0)
    for operand, curve, bound in zip(
        (operands.cosine, operands.highlight), found, (p.diffuse_error, p.highlight_error), strict=True
    ):
        error = np.abs(operand.values - ONE_VALUE * curve)[kept]
        assert error.max() <= bound(0.5, 0.125) + step
        assert error.max() > step / 2


def test_mixed_lengths_do_not_touch_each_other():
    """In spans of mixed lengths, the pixels of each span equal those of the span alone."""
    rng, count = np.random.default_rng(4), 120
    values, length = Surface(rng, count, 1, 0.3, 0.3, 20).values(), mixed_lengths(rng, count)
    together = METHOD.compute_values(values, length)
    alone = [
        METHOD.compute_values(SpanValues(*(codes[k : k + 1] for codes in values)), length[k : k + 1])
        for k in range(count)
    ]
    for name in ("cosine", "highlight"):
        expected = np.concatenate([getattr(one, name).codes for one in alone])
        np.testing.assert_array_equal(getattr(together, name).codes, expected)
    np.testing.assert_array_equal(together.out_of_range, [one.out_of_range[0] for one in alone])


def test_exact_operands():
    """The exact operands equal the written-out quadratics at every pixel.

    A span of one pixel has its first value.
    """
    rng = np.random.default_rng(2)
    surface = Surface(rng, 50, 3, 0.2, 0.2, 20)
    length = rng.integers(1, 9, 50)
    values = surface.values()
    found = METHOD.exact_operands(values, length)
    span, step = pixels_of(length)
    nodes = np.array([0, 0.5, 1])
    for codes, exact, unit in zip(values, found, (2.0**-25, 2.0**-26), strict=True):
        for pixel in range(len(span)):
            t = step[pixel] / max(length[span[pixel]] - 1, 1)
            weights = [np.prod([(t - b) / (a - b) for b in nodes if b != a]) for a in nodes]
            expected = codes[span[pixel]] @ weights * unit / (ONE / 2**17) ** 2
            assert exact[pixel] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_equal_values(length):
    """With equal values every pixel of a span equals its first, up to the last rounding."""
    rng = np.random.default_rng(length)
    diffuse, highlight = rng.uniform(-1, 1, (40, 2, 1)), rng.uniform(0, 2, (40, 2, 1))
    diffuse[:2], highlight[:2] = [[[-1.0]], [[1.0]]], [[[0.0]], [[2.0]]]
    values = SpanValues.quantise(diffuse.repeat(3, axis=2), highlight.repeat(3, axis=2))
    operands = METHOD.compute_values(values, np.full(40, length))
    assert not operands.out_of_range.any()
    for operand, codes in ((operands.cosine, values.diffuse), (operands.highlight, values.highlight / 2)):
        found = operand.codes.reshape(40, length, 2)
        np.testing.assert_array_equal(found, np.repeat(np.floor(codes[:, None, :, 0] + 0.5), length, axis=1))


def test_peak_in_the_middle_and_at_the_ends():
    """u = 0 at a pixel gives the operand 0, up to the rounding of G. It never goes below 0."""
    values = SpanValues.quantise(
        np.full((2, 1, 3), 0.7), np.array([[[1e-3, 0, 1e-3]], [[0, 1e-3, 4e-3]]], dtype=float)
    )
    for length in (3, 17, 4095):
        operands = METHOD.compute_values(values, np.full(2, length))
        u = operands.highlight.values.reshape(2, length)
        assert u[0, length // 2] <= 2.0**-22
        assert u[1, 0] == 0
        assert u.min() >= 0
