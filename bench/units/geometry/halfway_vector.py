"""Record of the half-way vector."""

import numpy as np

from blysk.bench.units.operands import any_codes, component_words, degrees_between, sphere, turned, unit_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.geometry.halfway_vector import HalfwayVector
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.lighting import halfway_vector
from blysk.hdl.geometry.halfway_vector import HalfwayVectorUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    halfway, opposite = unit.model.compute(*component_words(case.beats["light"], case.beats["viewer"]))
    return {"halfway": halfway.codes, "opposite": opposite}


def _vectors(unit, rng, count):
    """Directions to light and viewer. Some are equal, opposite or nearly opposite. Some have any codes."""
    beats = {"light": unit_codes(rng, count), "viewer": unit_codes(rng, count)}
    beats["viewer"][::5] = -beats["light"][::5]
    beats["viewer"][::10] += rng.integers(-3, 4, beats["viewer"][::10].shape)
    beats["viewer"][1::9] = beats["light"][1::9]
    beats["light"][2::11] = any_codes(rng, COMPONENT, *beats["light"][2::11].shape)
    beats["viewer"] = np.clip(beats["viewer"], COMPONENT.min_code, COMPONENT.max_code)
    return Case(beats)


def _measure(rng, count):
    light = sphere(rng, count)
    light, viewer = quantise(light), quantise(turned(rng, light, rng.uniform(0, 179, count)))
    halfway, _ = HalfwayVector().compute(*component_words(light, viewer))
    exact = halfway_vector(light / ONE, viewer / ONE)
    return Sample(halfway.codes / ONE, exact, None, degrees_between(light, viewer).reshape(-1, 1))


RECORD = Record(
    name="halfway_vector",
    title="Unit vector half-way between light and viewer",
    source="[T] figure 4.10",
    variants={
        "": Variant(HalfwayVectorUnit, _measure, "angles to 179 degrees", note="components divided by ONE")
    },
    expect=_expect,
    stimuli={"vectors": Stimulus(_vectors, 2000, pace=lambda unit: 1)},
    axis="angle between light and viewer, degrees",
)
