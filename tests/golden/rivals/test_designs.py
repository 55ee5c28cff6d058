"""Traced designs: their pixels are those of the pipelines, and their host's words those of the spans."""

import numpy as np
import pytest

from blysk.golden.frames.prepare import constants_of
from blysk.golden.reference.raster import rasterise
from blysk.golden.rivals.designs import SpanDesign
from blysk.golden.rivals.registry import COMPARED
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import screen_triangles

from .scenes import small_scene

DESIGNS = [name for name, of in COMPARED.items() if isinstance(of, SpanDesign)]


@pytest.mark.parametrize(
    "name", [name for name in DESIGNS if name not in ("renormalise, 2", "renormalise, 1")]
)
def test_pixels_are_those_of_the_pipeline(name):
    rival, scene = COMPARED[name], small_scene()
    raster = rasterise(scene)
    shades = rival.shade(scene, raster, Trace())
    design = rival.design(2)
    _, spans, _ = rival.prepared(scene, raster)
    found = design.compute(spans, constants_of(scene, design))
    np.testing.assert_array_equal(shades.color, found.color)


@pytest.mark.parametrize(
    ("name", "multipliers"),
    [
        *(("quotient", 16), ("quotient, phong", 17), ("chord-local", 9)),
        *(("renormalise, 3", 24), ("renormalise, 2", 26), ("renormalise, 1", 30)),
    ],
)
def test_counted_multipliers_are_those_of_the_hardware(name, multipliers):
    """The figures of docs/guide/fpga.md, from place and route and from netlists."""
    rival, scene = COMPARED[name], small_scene(lights=1)
    trace = Trace()
    rival.shade(scene, rasterise(scene), trace)
    assert trace.multipliers_at(rival.SPAN_CYCLES, rival.SETUP_CYCLES) == multipliers


@pytest.mark.parametrize("name", ["quotient", "renormalise, 3", "kuijk-blake"])
def test_the_host_makes_the_ends_of_spans(name):
    """Counted work of the host, against the ends that the raster made by other means."""
    rival, scene = COMPARED[name], small_scene()
    raster = rasterise(scene)
    triangles = screen_triangles(scene, raster)
    first = triangles.first
    planes = [plane[:, triangles.triangle[first]] for plane in rival.host(scene, triangles)]
    last = np.asarray(raster.length) - 1.0
    place = triangles.i[first].astype(float), triangles.j[first].astype(float), last
    start, other = rival.host_span(scene, planes, place, triangles.point[0][:, triangles.triangle[first]])
    end = start + other * last if name == "quotient" else other
    ends = (raster.normal_left, raster.magnitude_left), (raster.normal_right, raster.magnitude_right)
    for vector, (normal, length) in zip((start, end), ends, strict=True):
        if name == "quotient":
            # Axes of a frame keep lengths, and one factor scales both ends.
            found = np.linalg.norm(vector[:3], axis=0) / np.linalg.norm(start[:3], axis=0)
            np.testing.assert_allclose(found, length / raster.magnitude_left, rtol=1e-9)
        else:
            unit = vector / np.linalg.norm(vector, axis=0)
            np.testing.assert_allclose(unit.T, normal, atol=1e-9)
