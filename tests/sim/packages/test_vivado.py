"""The package for Vivado, by text: Tcl that Tcl itself runs, and a wrapper that Verilog readers take.

Vivado itself has not read it.
"""

import re
import subprocess

import pytest

from blysk.hdl.bus.bus import AxiLite, AxiStream

from .cores import environment, need, package

KINDS = {
    "shader": (),
    "render, narrow": ("--top", "render", "--stream", "32"),
}


@pytest.fixture(scope="module", params=[pytest.param(kind, marks=pytest.mark.long) for kind in KINDS])
def folder(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "there"
    return package(folder, "vivado", "--bus", "axi", *KINDS[request.param])


def test_script(folder):
    """Tcl runs the script to its end. Commands of Vivado are recorded, and files of the script exist."""
    need("tkinter")
    import tkinter

    calls = []
    tcl = tkinter.Tcl()
    tcl.createcommand("record", lambda *words: calls.append(words) or "it")
    tcl.eval("proc unknown args { record {*}$args }")
    tcl.eval("namespace eval ipx {}")
    tcl.evalfile(str(folder / "package.tcl"))
    names = [call[0] for call in calls]
    assert names[0] == "create_project"
    assert names[-2:] == ["ipx::save_core", "close_project"]
    (added,) = (call for call in calls if call[0] == "add_files")
    files = tcl.splitlist(added[-1])
    assert sorted(files) == sorted(str(path) for path in (folder / "rtl").iterdir())
    associated = [call for call in calls if call[0] == "ipx::associate_bus_interfaces"]
    assert [call[call.index("-busif") + 1] for call in associated] == ["s_axis", "m_axis", "s_axil"]
    assert "untried in Vivado" in (folder / "package.tcl").read_text()


def test_every_port_has_an_attribute(folder):
    """Each port but the clock and the reset belongs to an interface, with the signal of its name."""
    text = (folder / "rtl" / "core_vivado.v").read_text()
    head = text[: text.index(");")]
    ports = re.findall(r"^  (?:in|out)put (?:\[\d+:0\] )?(\w+)", head, re.MULTILINE)
    marked = re.findall(
        r'X_INTERFACE_INFO = "xilinx\.com:(\w+):(\w+):1\.0 (\w+) (\w+)" \*\)\n(?:  \(\*.*\*\)\n)?'
        r"  (?:in|out)put (?:\[\d+:0\] )?(\w+)",
        head,
    )
    assert [port for *_, port in marked] == ports
    kinds = {}
    for _, kind, interface, signal, port in marked[2:]:
        assert port == f"{interface}_{signal}".lower()
        kinds.setdefault(interface, (kind, set()))[1].add(signal.lower())
    assert kinds["s_axil"] == ("aximm", set(AxiLite().members))
    assert kinds["m_axis"] == ("axis", set(AxiStream(1, 2).members))
    assert kinds["s_axis"] == ("axis", set(AxiStream(1).members))
    assert [mark[1:] for mark in marked[:2]] == [
        ("clock", "aclk", "CLK", "aclk"),
        ("reset", "aresetn", "RST", "aresetn"),
    ]
    assert "ASSOCIATED_BUSIF s_axis:m_axis:s_axil, ASSOCIATED_RESET aresetn" in head


def test_the_wrapper_is_verilog(folder, tmp_path):
    """Icarus Verilog and Verilator elaborate the wrapper with the core, and with its memory of depths."""
    need("verilator", programs=("iverilog",))
    sources = [str(path) for path in (folder / "rtl").iterdir()]
    read = ["iverilog", "-g2001", "-Wall", "-Wno-timescale", "-s", "core_vivado", "-o", str(tmp_path / "a")]
    done = subprocess.run([*read, *sources], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    lint = ["verilator", "--lint-only", "--top-module", "core_vivado", "-Wno-WIDTH"]
    done = subprocess.run([*lint, *sources], capture_output=True, text=True, env=environment(tmp_path))
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
