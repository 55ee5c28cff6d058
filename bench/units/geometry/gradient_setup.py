"""Record of the gradient setup."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant, first
from blysk.bench.units.sample import Sample
from blysk.bench.units.triangles import WHOLE, Stages, random_triangles, scales_of
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.gradient_setup import GradientSetupUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    corners = (Fixed(ATTRIBUTE, case.beats[name]) for name in ("first", "middle", "last"))
    gradients = GradientSetup().compute(*corners, scales_of(case.beats))
    return gradients.beats | {"least": case.beats["least"]}


def _beats(rng, stages):
    count = len(stages.drawn)
    values = stages.drawn.triangles.attributes[np.arange(count), :, rng.integers(0, 4, count)]
    ends = rng.random(count) < 0.05
    values[ends] = rng.choice([ATTRIBUTE.min_code, ATTRIBUTE.max_code, 0], (ends.sum(), 3))
    corners = dict(zip(("first", "middle", "last"), values.T, strict=True))
    scales = {name: value for name, value in stages.scales.beats.items() if name != "sliver"}
    return corners | scales | {"least": rng.integers(0, 3457, count)}


def _attributes(unit, rng, count, size=12.0):
    """Attributes of triangles of all kinds. Some values are extreme codes."""
    stages = Stages(random_triangles(rng, 4 * count, size=size), WHOLE)
    return Case(first(_beats(rng, stages), count))


def _large(unit, rng, count):
    """Attributes of triangles of any size."""
    return _attributes(unit, rng, count, 1500.0)


def _measure(rng, count):
    """The step per pixel times the width of the triangle, against the product in float64."""
    stages = Stages(random_triangles(rng, count, size=100.0), WHOLE)
    y = stages.drawn.triangles.y.astype(float)
    values = stages.drawn.triangles.attributes[:, :, 0] * 2.0**-23
    share = (y[:, 1] - y[:, 0]) / (y[:, 2] - y[:, 0])
    exact = values[:, 1] - values[:, 0] - share * (values[:, 2] - values[:, 0])
    width = stages.drawn.area / (y[:, 2] - y[:, 0]) / 256
    # The word is the step per pixel modulo 4. In narrow triangles the step may be larger.
    kept = ~stages.scales.sliver & (width > 2)
    found = stages.gradients.inward.values[:, 0] * width
    return Sample(found[kept], exact[kept], None, np.log2(width[kept]))


RECORD = Record(
    name="gradient_setup",
    title="Start of an attribute and its steps along the long edge and along a scanline",
    source="docs/theory/geometry.md#normals",
    variants={
        "interval 4": Variant(
            GradientSetupUnit,
            _measure,
            "triangles over 2 pixels wide",
            note="error of the step per pixel times the width",
        ),
        "interval 12": Variant(partial(GradientSetupUnit, 12)),
        "interval 6": Variant(partial(GradientSetupUnit, 6), long=True),
    },
    expect=_expect,
    stimuli={"attributes": Stimulus(_attributes, 2000), "large": Stimulus(_large, 1000)},
    axis="width of the triangle, log2 of pixels",
    still={
        "the lower half of a word is narrower than a multiplier's operand": "multiplier_1_{b,1}[9-17] "
        "multiplier_2_{a,0}[16-17]",
        "`rise` has one fraction bit more than the attributes whose difference it is": "rise[0]",
        "the fraction ends with a constant 1, for half a step": "fraction_word[0]",
        "the shifter's operand has a 0 below its word, for the rounding": "shifter_0_0[0]",
    },
)
