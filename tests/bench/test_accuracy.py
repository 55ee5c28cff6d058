"""Frames of the exponents that the caller names, and their errors."""

import math
import re
from pathlib import Path

import pytest

import blysk
from blysk.bench.accuracy import measure, scene_for
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.sim.meshes.teapot import teapot


@pytest.mark.long
def test_measures_every_exponent():
    rows = list(measure(teapot(500), preset(model="cosquad"), (1, 100), 64, 48))
    assert [row[0] for row in rows] == [1, 100]
    first, second = (row[1] for row in rows)
    assert first.pixels == second.pixels > 500
    assert (first.image != second.image).any()
    for _, _, result in rows:
        assert 0 < result.arithmetic_error.max_lsb <= 1
        assert result.total_error.max_lsb > 5


@pytest.mark.parametrize("exponent", [10, 1000])
@pytest.mark.parametrize("ambient", [None, 0.02])
def test_errors_of_srgb_are_under_an_lsb(ambient, exponent):
    """The bench's grey material, and the default material in dark ambient light, off the border."""
    mesh = teapot(992)
    scene = scene_for(mesh, exponent, 160, 120)
    if ambient is not None:
        scene = blysk.scene(
            (mesh.vertices, mesh.faces, mesh.normals), size=(160, 120), ambient=ambient, exponent=exponent
        )
    design = blysk.design().for_materials(scene.materials)
    assert design.transfer == "srgb"
    found = compare(scene, design, model_frame(scene, design))
    assert 0.48 < found.total_error.steady_lsb <= min(0.6, found.bound_lsb)
    assert found.bound_lsb < 1.2


@pytest.mark.long
@pytest.mark.parametrize(
    ("column", "options"),
    [
        (0, {}),
        (1, {"model": "phong"}),
        (2, {"method": "renormalise"}),
        (3, {"method": "quadratic", "operand": "one_minus_cosine"}),
        (4, {"method": "quadratic", "model": "cosquad"}),
    ],
    ids=str,
)
def test_the_table_in_readme_is_what_its_command_prints(column, options):
    """The table has the errors of the bit-accurate model of the frame that the command simulates."""
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    command = "`blysk render teapot --transfer linear --exponent 100 --method ... --model ...`"
    assert command in " ".join(text.split())
    names = "largest error found|bound of this error"
    rows = [
        row.split("|")[column].strip()
        for row in re.findall(rf"^\| (?:{names})[^|]*\|(.+)\|$", text, re.MULTILINE)
    ]
    scene = blysk.scene("teapot", exponent=100)
    design = blysk.design(transfer="linear", **options).for_materials(scene.materials)
    found = compare(scene, design, model_frame(scene, design))
    assert found.target == ("phong" if design.mirror else "blinn")
    error, bound = rows
    assert f"{found.total_error.steady_lsb:.{len(error.partition('.')[2])}f}" == error
    # A bound is rounded up.
    assert ("none" if found.bound_lsb is None else f"{math.ceil(100 * found.bound_lsb) / 100:.2f}") == bound
