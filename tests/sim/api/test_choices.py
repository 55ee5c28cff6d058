"""Every value that an option offers is accepted in some combination with the others."""

import itertools

import numpy as np
import pytest

import blysk
from blysk.golden.build import Build
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.reference.lobes import COPLANAR_PHONG
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import PHONG
from blysk.golden.reference.renderer import render
from blysk.sim.api import options
from blysk.sim.api import render as rendering
from blysk.sim.errors import InputError, OptionError
from blysk.sim.value_types import Choice, Few, Truth


def offered(option):
    """The values that an option's help lists; none for a range and for free forms."""
    kind = option.kind
    if isinstance(kind, Choice):
        return kind.names
    if isinstance(kind, Few):
        return kind.numbers
    return (False, True) if isinstance(kind, Truth) else ()


def accepted(settings):
    """Whether a rendering can be prepared up to the model. Refusals come earlier."""
    try:
        read = rendering.rendering_settings("teapot", {"size": (16, 12), "triangles": 220, **settings})
        rendering._built(read, rendering._design(read))
    except OptionError:
        return False
    return True


def test_options_of_a_rendering_replace_the_core_of_its_design():
    """A design that drew a frame by hardware geometry can draw another frame from spans."""
    design = blysk.design(style="compact")
    read = rendering.rendering_settings("teapot", {"geometry": "hardware", "coarse": True, "setups": 2})
    by_triangles = rendering._built(read, design)
    assert by_triangles.build == Build("compact", top="render", setups=2, coarse=CoarseDepth(*read["size"]))
    plain = rendering.rendering_settings("teapot", {"pipes": 4})
    assert rendering._built(plain, by_triangles) == design.built(pipes=4)


def test_no_choice_of_a_rendering_is_always_refused():
    table = options.DESIGN | options.RENDERING
    choices = {name: offered(option) for name, option in table.items() if offered(option)}
    assert {"method", "model", "operand", "gate", "style", "geometry", "pipes", "setups"} <= choices.keys()
    taken = set()
    crossed = ("method", "model", "gate", "geometry", "style")
    for values in itertools.product(*(choices[name] for name in crossed)):
        settings = dict(zip(crossed, values, strict=True))
        # A pair that was accepted once is not tried again.
        pairs = set(itertools.combinations(settings.items(), 2))
        if not pairs <= taken and accepted(settings):
            taken |= pairs
    for method in choices["method"]:
        for model in choices["model"]:
            served = model != "phong" or method == "quotient"
            assert ((("method", method), ("model", model)) in taken) == served
    single = {pair for pairs in taken for pair in pairs}
    for name in choices.keys() - {*crossed}:
        for value in choices[name]:
            needs = ({}, {"geometry": "hardware"}, {"specialise": True}, {"method": "linear"})
            if any(accepted({name: value, **others}) for others in needs):
                single.add((name, value))
    missing = [(name, value) for name, of in choices.items() for value in of if (name, value) not in single]
    assert not missing


@pytest.mark.parametrize("method", ["renormalise", "linear"])
def test_phong_is_refused_with_the_model_that_is_near_it(method):
    with pytest.raises(
        InputError,
        match=r"^model phong: .* finds N\.H, not R\.V; use method quotient; or phong_coplanar, .* 11 LSB",
    ):
        blysk.design(model="phong", method=method)
    # This line has the figure of the default scene, exact against exact.
    scene = blysk.scene("teapot")
    raster = rasterise(scene)
    pair = (render(scene, "phong", model, raster).image for model in (PHONG, COPLANAR_PHONG))
    assert round(255 * np.abs(np.subtract(*pair)).max()) == 11
