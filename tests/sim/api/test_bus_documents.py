"""Register maps as Markdown, C header and SVD: the same registers, and a header that a compiler takes."""

import re
import subprocess
import xml.etree.ElementTree as ET
from shutil import which

import pytest

from blysk.golden.presets import preset
from blysk.hdl.bus.bus import BusUnit
from blysk.sim.api.bus_documents import FRAME, documents_of

pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl._ir.UnusedElaboratable")

CORES = {
    "shader": preset("quotient", "blinn", 2, materials=3),
    "render": preset(),
    "geometry": preset("linear", "cosquad"),
}


@pytest.fixture(scope="module", params=CORES)
def unit(request):
    return BusUnit(CORES[request.param].built(top=request.param, bus="axi"))


def test_map_has_no_overlap(unit):
    addresses = [register.address for register in unit.map.registers]
    assert addresses == sorted(set(addresses))
    assert all(address % 4 == 0 and address < 1 << 12 for address in addresses)
    assert len(unit.map.by_name) == len(addresses)


def test_documents_have_every_register(unit):
    texts = documents_of(unit, "core")
    expected = {register.name: register.address for register in unit.map.registers}
    rows = re.findall(r"^\| 0x(\w+) \| `(\w+)` \|", texts[".md"], re.MULTILINE)
    assert {name: int(address, 16) for address, name in rows} == expected
    defined = re.findall(r"^#define CORE_(\w+) 0x(\w{3})u", texts[".h"], re.MULTILINE)
    assert {name.lower(): int(address, 16) for name, address in defined} == expected
    registers = ET.fromstring(texts[".svd"].encode()).findall(".//register")
    found = {one.findtext("name").lower(): int(one.findtext("addressOffset"), 16) for one in registers}
    assert found == expected
    for one, register in zip(registers, unit.map.registers, strict=True):
        ends = [
            int(part.findtext("bitOffset")) + int(part.findtext("bitWidth"))
            for part in one.findall(".//field")
        ]
        assert max(ends) == register.width


def test_documents_state_the_frame_of_vectors(unit):
    """If a method takes vectors, the documents state their frame beside the field; otherwise they do not."""
    of_packets = {"span": "int32_t start[", "run": "int32_t normal["}
    field = of_packets.get(unit.framing.packets)
    for suffix in (".md", ".h"):
        text = documents_of(unit, "core")[suffix]
        lines = [line for line in text.splitlines() if FRAME in line]
        assert len(lines) == (field is not None)
        assert all(field in line for line in lines)


@pytest.mark.skipif(which("c++") is None, reason="there is no C++ compiler")
def test_header_is_c(unit, tmp_path):
    """A compiler confirms every size and offset."""
    (tmp_path / "core.h").write_text(documents_of(unit, "core")[".h"])
    layouts = unit.framing.model
    lines = ['#include "core.h"', "#include <cstddef>"]
    for kind, layout in (("input", layouts.given), ("output", layouts.made)):
        lines.append(f'static_assert(sizeof(core_{kind}) == {layout.size}, "");')
        for field, offset in zip(layout.fields, layout.offsets, strict=True):
            lines.append(f'static_assert(offsetof(core_{kind}, {field.name}) == {offset}, "{field.name}");')
    (tmp_path / "check.cc").write_text("\n".join(lines))
    subprocess.run(["c++", "-std=c++17", "-fsyntax-only", "check.cc"], cwd=tmp_path, check=True)
