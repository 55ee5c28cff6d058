"""Vectors of the quotient method from geometry's spans, against N/W in float64."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.units.triangles import random_triangles
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.span_attributes import SPAN_NORMAL, SPAN_STEP, Pieces
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.number.fixed import SQ, Fixed

FRAME = FrameSettings(-200, -200, 200, 200)


@pytest.fixture(scope="module")
def pieces():
    triangles = random_triangles(np.random.default_rng(3), 400, size=40.0, spread=0.5)
    return Geometry(vectors=True).pieces(triangles, FRAME)[1]


def test_vectors_are_in_proportion(pieces):
    """Both ends are N/W times the same power of two, to the rounding of the words.

    They are turned if the flag says so.
    """
    spans = VectorAdapter().compute(pieces)
    sign = np.where(pieces.flip, -1.0, 1.0)[:, np.newaxis]
    left, right = sign * pieces.left.values, sign * pieces.right.values
    largest = np.maximum(np.abs(left), np.abs(right)).max(axis=1)
    scale = 2.0 ** np.clip(np.floor(-np.log2(np.maximum(largest, 2.0**-30))), 0, SpanHalver.LARGEST_SHIFT)
    step = spans.step * (2.0**-spans.exponent * (spans.length - 1))[:, np.newaxis]
    # A power of two may be shifted by one place less.
    usual = np.log2(largest) % 1 > 1e-6
    assert usual.mean() > 0.98
    scale = scale[:, np.newaxis] * 2.0**17 * (1 - 2.0**-14)
    assert np.abs(spans.start - left * scale)[usual].max() <= 0.5 + 2.0**-9
    # The ends of geometry are cut to 26 fraction bits. After a shift by 7 places this is a quarter of a step.
    error = np.abs(spans.start + step - right * scale)[usual]
    change = np.maximum(np.abs(step).max(axis=1, keepdims=True) * 2.0**-17, 1 / 16)[usual]
    assert (error <= 0.5 + change + 0.25 + 1 / 8).all()
    assert error.max() > 0.6
    assert 0.1 < pieces.flip.mean() < 0.9
    assert 0.1 < pieces.turned.mean() < 0.9
    assert np.unique(spans.exponent).size > 8


def test_no_pixel_reaches_1(pieces):
    """The last pixel of a span does not reach 1 either, with its rounded step.

    There z would wrap, and the highlight would be lost.
    """
    left, right = (end.codes.copy() for end in (pieces.left, pieces.right))
    chosen = np.flatnonzero(pieces.length > 2)
    shift = np.arange(len(chosen)) % 8
    # Ends go from anywhere to 1, or -1, less a step of N/W, times a power of two.
    right[chosen, 2] = (SPAN_NORMAL.max_code >> shift) * np.where(shift < 4, 1, -1)
    left[chosen, 2] = right[chosen, 2] // 2 + (left[chosen, 2] >> (shift + 3))
    for end in (left, right):
        end[chosen, :2] >>= shift[:, np.newaxis] + 2
    step = np.rint((right - left) * 64 / np.maximum(pieces.length - 1, 1)[:, np.newaxis]).astype(np.int64)
    step = np.where(pieces.turned[:, np.newaxis], -step, step)
    ends = {name: Fixed(SPAN_NORMAL, codes) for name, codes in (("left", left), ("right", right))}
    spans = VectorAdapter().compute(replace(pieces, **ends, step=Fixed(SPAN_STEP, step)))
    last = spans.start + spans.step * (2.0**-spans.exponent * (spans.length - 1))[:, np.newaxis]
    largest = np.abs(last[chosen, 2])
    assert 2**17 - 12 < largest.min() <= largest.max() < 2**17 - 4


def test_a_step_of_every_size():
    """The exponent is the largest with which the step is under 1, and at most 15."""
    size = np.arange(1, 33)
    codes = np.zeros((32, 3), dtype=np.int64)
    codes[:, 1] = -(1 << (size - 1))
    ends = Fixed(SQ(1, 26), np.full((32, 3), 1 << 25))
    none = dict.fromkeys(("x", "y", "material", "triangle"), np.zeros(32, dtype=np.int64))
    flags = dict.fromkeys(("flip", "turned"), none["x"] > 0)
    depths = dict.fromkeys(("depth", "depth_last", "depth_step"), Fixed(SQ(25, 9), none["x"]))
    given = {"length": np.full(32, 3), "left": ends, "right": ends} | none | depths | flags
    spans = VectorAdapter().compute(Pieces(**given, step=Fixed(SQ(2, 32), codes)))
    np.testing.assert_array_equal(spans.exponent, np.minimum(33 - size, 15))
    exact = np.ldexp((codes[:, 1] - (codes[:, 1] >> 14)).astype(float), spans.exponent - 15)
    np.testing.assert_array_equal(spans.step[:, 1], np.floor(exact + 0.5))
    with pytest.raises(ValueError, match="pieces must have ends"):
        VectorAdapter().compute(Pieces(**given))
