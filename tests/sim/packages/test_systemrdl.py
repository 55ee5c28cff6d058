"""Registers in SystemRDL and IP-XACT, read by PeakRDL's compiler: the registers of the C header."""

import re
import xml.etree.ElementTree as ET
from types import SimpleNamespace

import pytest

from blysk.golden.presets import preset
from blysk.hdl.bus.bus import BusUnit
from blysk.sim.api.bus_documents import documents_of
from blysk.sim.packages.registry import PACKAGES

from .cores import need

IPXACT = {"ipxact": "http://www.accellera.org/XMLSchema/IPXACT/1685-2014"}
CORES = {
    "shader": preset("quotient", "blinn", 2, materials=3),
    "geometry": preset("linear", "cosquad"),
    "render": preset("quotient", "phong", 3),
}


@pytest.fixture(scope="module", params=CORES)
def core(request):
    """What a package of registers needs of a core, and the addresses of its C header."""
    unit = BusUnit(CORES[request.param].built(top=request.param, bus="axi"))
    header = documents_of(unit, "core")[".h"]
    defined = re.findall(r"^#define CORE_(\w+) 0x(\w{3})u", header, re.MULTILINE)
    addresses = {name.lower(): int(address, 16) for name, address in defined}
    masks = {
        f"{name}_{bit}".lower(): int(mask, 16)
        for name in addresses
        for bit, mask in re.findall(rf"^#define CORE_{name.upper()}_(\w+) 0x(\w+)u", header, re.MULTILINE)
        if f"{name}_{bit}".lower() not in addresses
    }
    return SimpleNamespace(name="core", map=unit.map, version="0.1.0", addresses=addresses, masks=masks)


def registers(text, folder):
    """Every register as PeakRDL's compiler elaborates it."""
    need("systemrdl")
    from systemrdl import RDLCompiler

    path = folder / "registers.rdl"
    path.write_text(text)
    compiler = RDLCompiler()
    compiler.compile_file(str(path))
    return list(compiler.elaborate().top.registers())


def test_systemrdl_has_the_registers_of_the_header(core, tmp_path):
    """Addresses, widths, masks of fields, and what software may do."""
    found = registers(PACKAGES["systemrdl"].files(core)["core.rdl"], tmp_path)
    assert {register.inst_name: register.absolute_address for register in found} == core.addresses
    assert len(found) == len(core.addresses) > 10
    masks = {
        f"{register.inst_name}_{field.inst_name}": (1 << field.high + 1) - (1 << field.low)
        for register in found
        for field in register.fields()
    }
    assert core.masks.items() <= masks.items()
    assert len(core.masks) > 5
    for register in found:
        of = core.map[register.inst_name]
        assert max(field.high for field in register.fields()) == of.width - 1
        assert register.has_sw_readable == (of.access != "write-only")
        assert register.has_sw_writable == (of.access != "read-only")
        assert register.size == 4


def test_ipxact_has_the_registers_of_the_header(core):
    """The file as any reader of XML sees it."""
    need("systemrdl", "peakrdl_ipxact")
    root = ET.fromstring(PACKAGES["ipxact"].files(core)["core.xml"].encode())
    found = root.findall(".//ipxact:register", IPXACT)
    addresses = {
        one.findtext("ipxact:name", None, IPXACT): one.findtext("ipxact:addressOffset", None, IPXACT)
        for one in found
    }
    assert {name: number(text) for name, text in addresses.items()} == core.addresses
    assert root.findtext("ipxact:version", None, IPXACT) == "0.1.0"


def number(text):
    """A number of IP-XACT, in Verilog's form or C's."""
    return int(text.replace("'h", "0x"), 0)
