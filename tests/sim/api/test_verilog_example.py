"""The worked example of a Verilog header, as an engineer would read it, against the frame's own constants."""

import re
from dataclasses import replace

import numpy as np
import pytest

import blysk
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.bus.registers import constant_registers
from blysk.golden.frame_constants import LOBE_ADDRESS, address_table
from blysk.golden.presets import preset
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.api.verilog import _descriptions as descriptions_of
from blysk.sim.api.verilog import header_of
from blysk.sim.api.verilog_example import EXPONENT, example_of


def writes_in(lines):
    return {int(a): int(d) for line in lines for a, d in re.findall(r"(\d+): (-?\d+)", line)}


@pytest.mark.parametrize("materials", [1, 3])
def test_values_follow_from_the_text(materials):
    """Colours are 255 times the coefficient in UQ(11, 6). A table's words follow from u."""
    lines = example_of(preset("renormalise", "blinn", 2, materials=materials))
    found = writes_in(line for line in lines if line.startswith("  ") and "entry" not in line)
    assert found[0] == EXPONENT
    assert [found[k] for k in (1, 22, 41)] == [round(255 * 64 * c) for c in (0.05, 0.4, 0.55)]
    assert [found[k] for k in (16, 17, 18)] == [0, 0, 2**17 - 1]
    # Entry 168 is step 8 of row 10.
    (entry,) = (int(line.rpartition("entry 168: ")[2]) for line in lines if "entry 168: " in line)
    exact = REFLECTION_MODELS["blinn"].reflect(1 - 1.5 * 2.0 ** (10 - 21), EXPONENT)
    assert abs(entry / 2**17 - float(exact)) < 0.1 / 255
    assert any(f"writes to address {LOBE_ADDRESS} " in line for line in lines)


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_table_of_quotients_follows_from_the_text(model):
    """The table is read by s = 1 - (N.H)^2, and by (N.H)^2; or by (1 - R.V)/2 alone.

    L is in the frame of the light.
    """
    design = preset("quotient", model)
    lines = example_of(design)
    found = writes_in(line for line in lines if line.startswith("  ") and "entry" not in line)
    assert [found[k] for k in (16, 17, 18)] == [0, 0, 2**17 - 2]
    (text,) = (line for line in lines if "writes to address" in line)
    assert ("s = (1 - R.V)/2" if model == "phong" else "s = 1 - (N.H)^2") in text
    table = design.specular.table(EXPONENT).writes(0)["value"][1:]
    cosine_of = {"phong": [lambda s: 1 - 2 * s], "blinn": [lambda s: np.sqrt(1 - s), np.sqrt]}[model]
    assert len(cosine_of) == 1 + any("function of c = (N.H)^2, in the same " in line for line in lines)
    for part, cosine in enumerate(cosine_of):
        for row, step in ((15, 0), (12, 3), (3, 15), (0, 8)):
            s = (1 + step / 16) * 2.0 ** (row - 16) if row else step / 16 * 2.0**-15
            exact = REFLECTION_MODELS[model].reflect(cosine(s), EXPONENT)
            assert abs(table[256 * part + 16 * row + step] / 2**17 - exact) < 0.1 / 255


def test_vectors_are_said_to_be_what_is_read():
    """No method of vectors or values reads the half-way vector, and L is in its own frame."""
    for method, direction, halfway in (
        ("linear", "unit vector to the light", "unit half-way vector"),
        ("quotient", "sin a, 0, cos a of the light's frame", "not read"),
        ("chord-local", "not read", "not read"),
    ):
        design = preset(method, "blinn")
        lines = address_table(1, of_a_light=design.interpolator.light_meanings)
        assert [line.split(maxsplit=3)[3] for line in lines[2:4]] == [
            f"{text}, SQ(1, 17) (light 0)" for text in (direction, halfway)
        ]
        texts = {register.name: register.text for register in constant_registers(design)}
        assert texts["light0_direction_x"].startswith(direction)
        assert texts["light0_halfway_z"].startswith(halfway)
    assert texts["light0_direction_x"] == "not read"


def test_no_example_of_a_table_that_is_fixed_for_another_exponent():
    assert example_of(preset("renormalise", "blinn", exponent=20)) == []


@pytest.mark.parametrize("method", ["linear", "renormalise"])
def test_normals_are_described_as_they_are(method):
    """The ends of a true line are no unit vectors, and the text of their ports does not say so."""
    unit = ShadingPipelineUnit(preset(method, "cosquad"))
    (line,) = (line for line in header_of(unit) if line.startswith("i_normal_*"))
    texts = [text for port, text in descriptions_of(unit).items() if port.startswith("i_normal")]
    assert len(texts) == 2
    if method == "renormalise":
        assert "N/W" in line
        assert not any("unit" in text or "2^17" in text for text in (line, *texts))
    else:
        assert "unit vectors" in line


@pytest.mark.long
def test_header_has_an_instance_of_every_port():
    text = blysk.verilog(blysk.design(method="linear", model="cosquad"), name="core")
    ports = re.search(r"^module core \(([^)]*)\);", text, re.MULTILINE)[1]
    instance = re.search(r"^// core core_0 \((.*?)^// \);", text, re.MULTILINE | re.DOTALL)[1]
    assert re.findall(r"\.(\w+)\(\1\)", instance) == re.findall(r"\w+", ports)


@pytest.mark.long
def test_every_attribute_is_described():
    """Textures are inside. Other memories have ports of their own."""
    design = blysk.design(method="linear", model="cosquad")
    for external in (False, True):
        texture = TextureSampler(TexelMemory(8, external))
        text = blysk.verilog(replace(design, albedo=Albedo(texture=texture)), name="core")
        wanted = r"// (i_attributes_|texel_re)\w+ +(in|out)put"
        lines = [line for line in text.splitlines() if re.match(wanted, line)]
        assert len(lines) > (30 if external else 16)
        # Without a description a line ends with the format.
        assert not any(line.rstrip().endswith(")") for line in lines)
