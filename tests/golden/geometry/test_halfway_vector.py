"""Half-way vectors against float64, and opposite directions."""

import numpy as np

from blysk.bench.units.operands import component_words, sphere, turned
from blysk.golden.geometry.halfway_vector import HalfwayVector
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.lighting import halfway_vector


def test_bounds():
    """Direction and length are within the bounds at angles up to nearly 180 degrees."""
    rng = np.random.default_rng(1)
    light = sphere(rng, 100_000)
    light, viewer = quantise(light), quantise(turned(rng, light, rng.uniform(0, 179.9, len(light))))
    halfway, opposite = HalfwayVector().compute(*component_words(light, viewer))
    exact = halfway_vector(light / ONE, viewer / ONE)
    assert not opposite.any()
    found = halfway.codes / ONE
    assert np.linalg.norm(np.cross(found, exact), axis=1).max() < VectorNormaliser.DIRECTION_ERROR
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < VectorNormaliser.LENGTH_ERROR


def test_opposite():
    """Opposite directions have no direction half-way."""
    light = quantise(sphere(np.random.default_rng(2), 100))
    halfway, opposite = HalfwayVector().compute(*component_words(light, -light))
    assert opposite.all()
    assert not halfway.codes.any()
