"""The worked example of a Verilog header, read as an engineer would, against the frame's own constants."""

import re

import pytest

import blysk
from blysk.golden.frame_constants import LOBE_ADDRESS
from blysk.golden.presets import preset
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.api.design import _descriptions as descriptions_of
from blysk.sim.api.design import header_of
from blysk.sim.api.verilog_example import EXPONENT, example_of


def writes_in(lines):
    return {int(a): int(d) for line in lines for a, d in re.findall(r"(\d+): (-?\d+)", line)}


@pytest.mark.parametrize("materials", [1, 3])
def test_values_follow_from_the_text(materials):
    """Colours are 255 times the coefficient in UQ(11, 6); a table's words follow from u."""
    lines = example_of(preset("chord", "blinn", 2, materials=materials))
    found = writes_in(line for line in lines if line.startswith("  ") and "entry" not in line)
    assert found[0] == EXPONENT
    assert [found[k] for k in (1, 22, 41)] == [round(255 * 64 * c) for c in (0.05, 0.4, 0.55)]
    assert [found[k] for k in (16, 17, 18)] == [0, 0, 2**17 - 1]
    # Entry 168 is step 8 of row 10.
    (entry,) = (int(line.rpartition("entry 168: ")[2]) for line in lines if "entry 168: " in line)
    exact = REFLECTION_MODELS["blinn"].reflect(1 - 1.5 * 2.0 ** (10 - 21), EXPONENT)
    assert abs(entry / 2**17 - float(exact)) < 0.1 / 255
    assert any(f"writes to address {LOBE_ADDRESS} " in line for line in lines)


def test_no_example_of_a_table_that_is_fixed_for_another_exponent():
    assert example_of(preset("chord", "blinn", exponent=20)) == []


@pytest.mark.parametrize("method", ["chord", "linear", "renormalise"])
def test_normals_are_described_as_they_are(method):
    """The ends of a true line are no unit vectors, and no port of theirs is said to have one."""
    unit = ShadingPipelineUnit(preset(method, "cosquad"))
    (line,) = (line for line in header_of(unit) if line.startswith("i_normal_*"))
    texts = [text for port, text in descriptions_of(unit, 1).items() if port.startswith("i_normal")]
    assert len(texts) == (3 if method == "chord" else 2)
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
