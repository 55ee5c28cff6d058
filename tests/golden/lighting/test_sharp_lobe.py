"""Lobes that are too sharp for the words of u: scale, codes nearest in direction; steps for the others."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import (
    CODE_LENGTH_ERROR,
    COMPONENT,
    ONE,
    ONE_SQUARED,
    quantise,
    quantise_direction,
)
from blysk.golden.presets import LOBES, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

GGX, BECKMANN = (replace(LOBES[name], operand="one_minus_cosine") for name in ("ggx", "beckmann"))


@pytest.mark.parametrize("scale", [0, 3, 6])
def test_scaled_values(scale):
    """``min(2^s u, 1)`` of the codes, exact but for half a step; without a scale up to 2."""
    rng = np.random.default_rng(2)
    peak = normalise(rng.normal(size=3))
    normals = normalise(peak + 10.0 ** rng.uniform(-5, 1, (2000, 1)) * rng.normal(size=(2000, 3)))
    codes, halfway = quantise(normals), quantise(peak)[np.newaxis]
    words = Fixed(COMPONENT, codes), Fixed(COMPONENT, halfway), Fixed(COMPONENT, halfway)
    _, found = ChordValues(scale).compute(*words)
    u = np.square(codes - halfway).sum(axis=1) / 2 * COMPONENT.step**2
    most = 1.0 if scale else 2.0
    exact = np.minimum(2**scale * u, most)
    step = ChordValues.HIGHLIGHT_FORMAT.step
    near = u < 0.4
    assert np.abs(found.values[:, 0] - exact)[near].max() <= step / 2
    assert (found.values[u > 1.0 / 2**scale + 1e-3] >= 1 - step).all()
    if scale:
        assert found.values.max() == 1
    values = np.array([1e-4, 0.02, 2])
    given = SpanValues.quantise(np.zeros((1, 1, 3)), values[np.newaxis, np.newaxis], scale)
    scaled = np.minimum(values * 2**scale, most) * float(ONE_SQUARED.values)
    assert given.highlight.ravel() * step == pytest.approx(scaled, abs=step / 2)


def test_codes_nearest_in_direction():
    """Half as far in direction on average, and never farther; the length keeps its bound."""
    vectors = normalise(np.random.default_rng(3).normal(size=(4000, 3)))
    vectors[:3] = np.eye(3)
    misses = []
    for code in (quantise, quantise_direction):
        found = code(vectors) / ONE
        along = (found * vectors).sum(axis=1)
        assert np.abs(along - 1).max() <= CODE_LENGTH_ERROR * 1.01
        misses.append(np.linalg.norm(found - along[:, np.newaxis] * vectors, axis=1))
    assert (misses[1] <= misses[0] + 1e-12).all()
    assert misses[1].mean() < 0.6 * misses[0].mean()
    assert np.array_equal(quantise_direction(vectors[:3]), ONE * np.eye(3))
    assert quantise_direction(vectors[7]).tolist() == quantise_direction(vectors)[7].tolist()


def test_scale_of_lobes():
    """The largest that all are dark at; none where none is sharp, or one is as wide as it is sharp."""
    assert GGX.scale_of([0.05]) == GGX.scale_of([0.05, 0.06]) == 6
    assert GGX.scale_of([0.1, 0.05]) == 4
    assert GGX.scale_of([0.3]) == GGX.scale_of([0.05, 0.5]) == 0
    assert replace(LOBES["blinn"], operand="one_minus_cosine").scale_of([1, 1000]) == 0
    for roughness in (0.05, 0.08, 0.1):
        scale = GGX.scale_of([roughness])
        assert GGX.model.reflect(1 - 2.0**-scale, roughness) < 2.0**-18


def test_scaled_table():
    """Entries of ``S(2^-s u)``, within what lines and rounding take."""
    lobe = replace(GGX, scale=6)
    u = np.random.default_rng(4).uniform(0, 1, 4000) ** 4
    format = lobe.argument_format
    argument = Fixed(format, (u / format.step).astype(np.int64))
    found = lobe.compute(argument, np.zeros(len(u), dtype=bool), lobe.table(0.05))
    exact = lobe.model.reflect(1 - argument.values / 64, 0.05)
    assert 255 * np.abs(found.values - exact).max() < 0.05


def test_steps_for_lobes():
    """Beckmann's with a steep end gets finer steps, and then is off by a seventh of an LSB; others stay."""
    finer = BECKMANN.for_parameters([0.3, 1.0])
    assert (finer.octaves, finer.steps) == Lobe.FINER
    assert finer.entries <= 512
    assert 255 * finer._line_error(1.0) < 0.15 < 0.5 < 255 * BECKMANN._line_error(1.0)
    assert BECKMANN.for_parameters([0.3]) is BECKMANN
    assert GGX.for_parameters([0.05, 0.5]) is GGX
    mine = replace(BECKMANN, octaves=12, steps=8)
    assert mine.for_parameters([1.0]) is mine


@pytest.mark.parametrize(("model", "roughness"), [("ggx", 0.05), ("beckmann", 1.0)])
@pytest.mark.parametrize("method", ["chord", "chord-local"])
def test_frames(method, model, roughness):
    """Under 3/4 of an LSB, from lights that give highlights of a few pixels; without that it is not."""
    mesh = teapot(1000)
    coefficients = (0.05,) * 3, (0.4, 0.3, 0.2), (0.55, 0.5, 0.6)
    material = Material(*coefficients, 50, roughness)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1), "orthographic", 4 / 3)
    worst = []
    for design in (preset(method, model), preset(method, model).for_materials([material])):
        errors = []
        for direction in ((-0.5, 0.8, 0.7), (0.2, 1.1, 0.9), (0.9, 0.3, 0.6)):
            scene = Scene(mesh, camera, 160, 120, material, (Light(direction),))
            frame = model_frame(scene, design)
            assert frame.out_of_range_spans == frame.wide_spans == 0
            errors.append(compare(scene, design, frame).method_error.max_lsb)
        worst.append(max(errors))
    assert worst[1] < 0.75
    assert worst[1] <= worst[0]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: preset("chord", "ggx", scale=7), r"^scale must be 0 to 6, not 7$"),
        (lambda: preset("chord", "cosquad", scale=3), r"^a scale of 1 - N·H needs a lobe with a table$"),
        (lambda: Lobe(scale=2), r"^scale must be 0, or more of the operand one_minus_cosine, not 2$"),
        (
            lambda: replace(GGX, scale=6).check(GGX.table(0.05)),
            r"^the table is of 2\^0 u, the unit of 2\^6 u$",
        ),
        (lambda: ChordValues(-1), r"^scale must be 0 to 6, not -1$"),
    ],
)
def test_refusals(make, says):
    with pytest.raises(ValueError, match=says):
        make()
