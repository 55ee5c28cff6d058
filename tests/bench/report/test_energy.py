# amaranth: UnusedElaboratable=no
"""Toggled register bits by block: each register is in one block; the section made from the counts."""

from types import SimpleNamespace

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.report.energy import (
    BLOCKS,
    DESIGN,
    EXPONENTS,
    METHOD,
    METHODS,
    MODELS,
    by_block,
    measure,
    same_pixels,
    section,
    tasks,
)
from blysk.bench.report.section import Drawing, Table
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.toggles import ToggleCounter
from blysk.sim.meshes.teapot import teapot


def test_every_register_of_the_default_is_in_a_block():
    unit = ToggleCounter(ShadingPipelineUnit(preset(*DESIGN)))
    found = by_block(dict.fromkeys(unit.status.shape().members, 1))
    assert set(found) == set(BLOCKS)
    assert {block for block, count in found.items() if not count} == {"highlight gate"}


@pytest.mark.parametrize(
    ("method", "model"),
    [*((METHOD, model) for model in MODELS), *((name, MODELS[0]) for name in METHODS if name != METHOD)],
)
def test_every_register_is_in_a_block(method, model):
    """A real pipeline with a gate and without.

    The gate's registers are those that the first has in addition.
    """
    found = {}
    for gate in (False, True):
        unit = ToggleCounter(ShadingPipelineUnit(preset(method, model, gate=gate)))
        found[gate] = by_block(dict.fromkeys(unit.status.shape().members, 1))
        assert set(found[gate]) == set(BLOCKS)
        none = {"highlight gate"} if not gate else set()
        assert {block for block, count in found[gate].items() if not count} == none
        assert sum(found[gate].values()) == len(unit.status.shape().members)
    assert found[False] | {"highlight gate": found[True]["highlight gate"]} == found[True]


def test_inner_submodules_count():
    toggles = {
        "top": 1,
        "light_0.specular": 2,
        "light_0.specular.datapath": 4,
        "light_0.diffuse": 8,
        "interpolator.difference_setup.datapath.reciprocals": 16,
        "interpolator.difference_accumulator": 32,
        "something": 64,
    }
    found = by_block(toggles)
    assert {block: count for block, count in found.items() if count} == {
        "admission": 1,
        "specular": 6,
        "diffuse": 8,
        "setup of spans": 16,
        "cosines of pixels": 32,
        "others": 64,
    }


@pytest.mark.long
def test_counts_of_a_small_frame():
    """Pixels equal the model's, and every block has work."""
    for design in ((METHOD, "cosquad", True), (*DESIGN, False)):
        [found] = measure(*design, [50], [20, 15, 64], "pysim")
        assert found["same"]
        assert 20 < found["spans"] <= found["pixels"] < found["cycles"]
        assert sum(not count for count in by_block(found["toggles"]).values()) <= 2


@pytest.mark.long
def test_the_gate_spares_the_specular_unit():
    off, on = (measure(METHOD, "cosquad", gate, [2, 1000], [64, 48, 64], "auto") for gate in (False, True))
    for without, gated in zip(off, on, strict=True):
        assert without["same"]
        assert gated["same"]
        assert without["pixels"] == gated["pixels"]
        assert by_block(without["toggles"])["highlight gate"] == 0
    specular = [by_block(of["toggles"])["specular"] for of in (*off, *on)]
    # With small highlights more spans have no highlight.
    assert specular[3] / specular[1] < specular[2] / specular[0] <= 1


def frame(same=True, **toggles):
    return {"spans": 10, "pixels": 20, "cycles": 40, "toggles": toggles, "same": same}


def test_section():
    quick = tasks(quick=True)
    own, off, on = (
        frame(intensity=100, **{"interpolator.quotient": 60}),
        frame(intensity=300, slope=100),
        frame(intensity=280, slope=100, highlight_gate=40),
    )
    made = section(quick, [[own], [off], [on]])
    assert made.name == "energy"
    [table] = (part for part in made.parts if isinstance(part, Table))
    assert [part.name for part in made.parts if isinstance(part, Drawing)] == ["energy-blocks"]
    default, first, second = table.records()
    assert (default["method"], default["model"], default["gate"]) == (*DESIGN, "off")
    assert (default["cosines of pixels, bits a pixel"], default["saved, share"]) == (3, None)
    assert "switches 8 bits a pixel at exponent 50. `quadratic` with `cosquad` switches 20." in made.text[1]
    assert (first["gate"], second["gate"]) == ("off", "on")
    assert (first["intensity, bits a pixel"], first["pipeline, bits a pixel"]) == (15, 20)
    assert second["highlight gate, bits a pixel"] == 2
    assert (first["saved, share"], second["saved, share"]) == (None, pytest.approx(-0.05))
    assert [row[-1] for row in table.grades] == ["", "", "fair"]
    assert "void" not in " ".join(made.text)
    assert "void" in " ".join(section(quick, [[own], [frame(False, top=1)], [on]]).text)


@pytest.mark.long
def test_tasks():
    full = tasks(quick=False)
    assert [tuple(task.settings[name] for name in ("method", "model", "gate")) for task in full] == [
        (*DESIGN, False),
        *((METHOD, model, gate) for model in MODELS for gate in (False, True)),
        *((method, MODELS[0], gate) for method in METHODS if method != METHOD for gate in (False, True)),
    ]
    assert all(task.settings["exponents"] == list(EXPONENTS) for task in full)
    results = [[frame(top=10), frame(top=20), frame(top=40 - 20 * task.settings["gate"])] for task in full]
    made = section(full, results)
    assert len(made.parts[0].rows) == len(full) * len(EXPONENTS)


def test_a_pixel_that_differs_is_found():
    design = preset("quadratic", "cosquad")
    prepared = prepare(scene_for(teapot(300), 50, 40, 30), design)
    pixels = design.compute(prepared.spans, prepared.constants[0])
    names = ("x", "y", "r", "g", "b", "last")
    beats = np.zeros(len(pixels.x), [(name, np.int64) for name in names])
    for name, codes in zip(names, (pixels.x, pixels.y, *pixels.color.T, pixels.last), strict=True):
        beats[name] = codes
    assert same_pixels(SimpleNamespace(beats=beats), pixels)
    for name in names:
        wrong = beats.copy()
        wrong[name][-1] ^= 1
        assert not same_pixels(SimpleNamespace(beats=wrong), pixels)
    assert not same_pixels(SimpleNamespace(beats=beats[:-1]), pixels)
