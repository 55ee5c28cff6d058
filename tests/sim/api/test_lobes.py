"""Lobes through the Python interface: roughness, curves of files, banks of materials, bad input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import blysk
from blysk.golden.presets import preset
from blysk.golden.reference.lobes import GGX
from blysk.sim.api.design import design_of
from blysk.sim.api.options import DESIGN, SCENE
from blysk.sim.api.render import prepare_rendering
from blysk.sim.api.settings import read_settings, rendering_settings
from blysk.sim.api.verilog import verilog
from blysk.sim.errors import InputError
from blysk.sim.frames.figures import sharp_lobes

SMALL = {"size": (48, 36), "triangles": 300}


def many(count):
    """A scene with ``count`` materials, each with its own roughness."""
    scene = blysk.scene("teapot", **SMALL)
    (material,) = scene.materials
    mesh = replace(scene.mesh, material=np.arange(len(scene.mesh.faces)) % count)
    materials = [replace(material, roughness=0.2 + 0.8 * k / count) for k in range(count)]
    return replace(scene, mesh=mesh, material=materials)


@pytest.mark.parametrize(("roughness", "sharp"), [(0.05, 1), (0.1, 0), (1.0, 0)])
def test_lobes_that_are_too_sharp_are_counted(roughness, sharp):
    """The error of the lines between entries counts. Other methods have finer tables at the peak."""
    scene = blysk.scene("teapot", roughness=roughness, **SMALL)
    assert sharp_lobes(scene, preset(model="ggx")) == sharp
    assert (
        sharp_lobes(scene, preset("chord-local", "ggx"))
        == sharp_lobes(scene, preset("linear", "cosquad"))
        == 0
    )


def test_render_by_roughness():
    frame = blysk.render("teapot", model="ggx", roughness=0.3, engine="pysim", **SMALL)
    assert frame.figures["counts"]["sharp_lobes"] == 0
    assert frame.design.specular.reflection is GGX
    assert frame.scene.materials[0].roughness == 0.3
    assert frame.error.max_lsb < 0.8


def test_curve_of_a_file(tmp_path):
    path = tmp_path / "satin.csv"
    path.write_text("0,0\n0.9,0.1\n1,1\n")
    settings = read_settings("teapot", {"model": str(path), **SMALL}, {**SCENE, **DESIGN})
    assert design_of(settings, 1).model == "satin"


def test_measured_material():
    settings = read_settings("teapot", {"model": "measured:nickel", **SMALL}, {**SCENE, **DESIGN})
    assert design_of(settings, 1).model == "nickel"


@pytest.mark.long
def test_each_lobe_has_a_bank():
    scene = many(3)
    settings = rendering_settings(scene, {"model": "ggx", "gate": True})
    made = prepare_rendering(settings, engine="pysim")
    assert (made.design.materials, made.design.specular.banks) == (3, 3)


def test_too_many_lobes_are_refused():
    settings = rendering_settings(many(65), {"model": "ggx"})
    with pytest.raises(InputError) as caught:
        prepare_rendering(settings, engine="pysim")
    message = str(caught.value)
    assert "the materials have 65 lobes, the pipeline has banks for 64" in message
    assert "give materials an equal roughness" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"roughness": 0}, "out of range; give a number greater than 0 and at most 1"),
        ({"roughness": 1.1}, "out of range; give a number greater than 0 and at most 1"),
        ({"roughness": float("nan")}, "out of range; give a number greater than 0 and at most 1"),
        ({"model": "none.csv"}, "cannot be opened (No such file or directory); give a .csv file of cosines"),
        ({"model": "velvet"}, "unknown"),
        (
            {"model": "measured:velvet"},
            "is no measured material; give measured: with alum-bronze, blue-metallic",
        ),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(InputError) as caught:
        read_settings("teapot", options, {**SCENE, **DESIGN})
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("0,0\n,0.5\n1,1", "line 2 of a.csv must have two numbers, not ',0.5'"),
        ("cosine,value", "a must have at least 2 points, not 0"),
    ],
)
def test_bad_csv(tmp_path, monkeypatch, text, reason):
    """One line has the reason and a remedy, and nothing about other models."""
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_settings("teapot", {"model": "a.csv"}, {**SCENE, **DESIGN})
    message = str(caught.value)
    assert reason in message
    assert message.endswith("; give a .csv file of cosines N.H rising from 0 to 1 and values from 0 to 1")
    assert "\n" not in message


@pytest.mark.long
def test_verilog_tells_the_addresses_of_tables():
    text = verilog(blysk.design(model="ggx", method="quadratic", gate=True))
    assert "next value of a table, UQ(0, 17); with bit 17 set, number of the bank whose table begins" in text
    assert "of the table: where its highlight ends; UQ(0, 17)" in text
