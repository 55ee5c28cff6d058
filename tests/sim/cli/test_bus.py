"""``--top`` and ``--bus``: Verilog of every core, the files beside it, and refusals."""

from pathlib import Path

import pytest

from blysk.sim.cli.main import main

pytestmark = pytest.mark.usefixtures("folder")

SMALL = "--method", "linear", "--model", "cosquad"


def test_files_of_a_core_on_a_bus():
    """The header tells how to drive the core. The map is beside it in three forms."""
    assert main(["verilog", *SMALL, "--bus", "wishbone", "-o", "core.v"]) == 0
    text = Path("core.v").read_text()
    for told in (
        "Registers: Wishbone B4, wb_*",
        "s_axis_tdata, 32 bytes",
        "   8  int32_t normal_left[3]",
        "s_axis_tlast ends a frame",
        "  0x00C  errors",
        "Frame constants: register 0x800 + 4 address",
        "  .wb_stall(wb_stall)",
    ):
        assert told in text
    assert sorted(path.name for path in Path().iterdir()) == ["core.h", "core.md", "core.svd", "core.v"]


@pytest.mark.long
@pytest.mark.parametrize("method", ["linear", "renormalise", pytest.param("quotient", marks=pytest.mark.ci)])
def test_ports_of_geometry_alone(method):
    """Its own ports have descriptions, and the text explains the limit of spans."""
    assert main(["verilog", "--top", "geometry", "--method", method, "-o", "core.v"]) == 0
    lines = Path("core.v").read_text().splitlines()
    start = lines.index(next(line for line in lines if line.startswith("// port ")))
    ports = [line.split(maxsplit=6) for line in lines[start + 1 : lines.index("//", start)]]
    assert all(len(port) == 7 for port in ports)
    names = [port[1] for port in ports]
    assert {"i_two_sided", "constants_limit", "status_cut", "o_valid"} < set(names)
    assert "constants_picture" not in names
    read = {"linear": "2048 sin(a / 2)"}.get(method, "is not read")
    assert f"// constants_limit: {read}" in "\n".join(lines)


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--bus", "ahb"], "--bus ahb", "unknown bus; use one of native, axi, wishbone"),
        (["--top", "cpu"], "--top cpu", "unknown core; use one of shader, geometry, render"),
        (["--top", "shader", "--geometry", "hardware"], "--top shader", "it takes spans"),
        (["--bus", "axi", "--pipes", "2"], "--pipes 2", "a core on axi has one pipeline"),
        (["--bus", "axi", "-o", "core.txt"], "-o core.txt", "use a name that ends in .v"),
        (["--bus", "axi", "--stream", "48"], "--stream 48", "give one of 32, 64, 128"),
        (["--stream", "32"], "--stream 32", "the core's own ports are no AXI4-Stream; also give bus"),
        (["--top", "render", "--method", "chord-local"], "--top render", "chord-local takes values"),
    ],
)
def test_refused(refused, options, thing, says):
    refused("verilog", *options, thing=thing, says=says)
    assert list(Path().iterdir()) == []
