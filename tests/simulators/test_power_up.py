"""Power-up: registers and written memories begin undefined, and one cycle of reset is enough.

Icarus Verilog gets a text without the initial values of registers and written memories. Every beat must equal
the model's, and no bit of a valid beat, of a valid or of a ready may be undefined. A text whose memories are
read at clock edges gives the same beats in the same cycles. Tables keep their words.
So does the memory of depths inside a renderer, because another unit clears it before a picture. `test_bus`
has the cores on buses.
"""

import numpy as np
import pytest

from blysk.bench.units.record import length_of
from blysk.bench.units.registry import RECORDS
from blysk.hdl.emit.verilog import emit

from .verilog_bench import VerilogBench, assert_beats, missing_tool, pauses, without_initial_values

CASES = {
    ("pipeline", "linear, cosquad"): 40,
    ("pipeline", "quotient, blinn"): 200,
    ("pipeline", "4 lanes"): 200,
    ("geometry", "two lanes"): 60,
    ("geometry", "compact"): 60,
    ("render", "quotient"): 60,
    ("render", "quotient, compact"): 60,
    ("render", "quotient, 2 lanes"): 60,
    ("pixel_pipelines", "2 pipelines, without lights"): 200,
    ("pipeline", "compact"): 40,
}
"""Beats or pixels of each unit. The registers of other structures are of the same kinds."""

CLOCKED = (
    ("pipeline", "quotient, blinn"),
    ("pipeline", "compact"),
    ("geometry", "two lanes"),
    ("geometry", "compact"),
    ("render", "quotient"),
    ("render", "quotient, compact"),
)
"""Units whose text is also tested with memories that are read at clock edges."""

QUICK = ("pipeline", "linear, cosquad")

PICTURE = (32 * 24, 16 * 24)
"""Words of the memory of depths in the record of `render`, and of a bank with two lanes."""


@pytest.mark.skipif(missing_tool("icarus") is not None, reason=str(missing_tool("icarus")))
@pytest.mark.parametrize(
    ("name", "variant"),
    [pytest.param(*case, marks=[pytest.mark.long] + [pytest.mark.ci] * (case == QUICK)) for case in CASES],
)
def test_one_cycle_of_reset_is_enough(name, variant, tmp_path):
    record, rng = RECORDS[name], np.random.default_rng(2026)
    unit = record.variants[variant].unit()
    # The memory of depths is a part of the record's renderer, not of an emitted core.
    options = {"zeros": name == "render"}
    texts = [emit(unit, "core", **options)]
    if (name, variant) in CLOCKED:
        texts.append(emit(unit, "core", memories="synchronous", **options))
    assert len(set(texts)) == len(texts)
    make = next(iter(record.stimuli_of(variant).values())).make
    case = make(unit, rng, CASES[name, variant])
    expected = record.expect(unit, case)
    assert length_of(expected) >= 40
    sent = {"constants": case.constants, "write": case.write, **pauses(rng)}
    cycles = []
    for number, whole in enumerate(texts):
        text = without_initial_values(whole, PICTURE)
        assert whole.count("initial") > 100 > text.count("initial")
        folder = tmp_path / str(number)
        folder.mkdir()
        found = VerilogBench(unit, folder, text).run(
            "icarus", case.beats, length_of(expected), idle_timeout=50_000, **sent
        )
        assert_beats(found.beats, expected)
        cycles.append(found.cycles)
    np.testing.assert_array_equal(cycles[0], cycles[-1])


def test_what_keeps_its_words():
    """A register and a written memory lose their words.

    A table, and a memory whose size is named, keep them.
    """
    memory = "  reg [3:0] {0} [{1}:0];\n  initial begin\n    {0}[0] = 4'h0;\n    {0}[1] = 4'h1;\n  end\n"
    writes = "  always @(posedge clk) begin\n    if (en)\n      {0}[a] <= d;\n  end\n"
    parts = [
        "module core (clk);\n",
        "  reg [1:0] state;\n",
        "  initial state = 2'h1;\n",
        memory.format("table_", 1),
        memory.format("stack", 3),
        memory.format("picture", 7),
        writes.format("stack"),
        writes.format("picture"),
        "endmodule\n",
    ]
    kept = [*parts[:2], parts[3], "  reg [3:0] stack [3:0];\n", *parts[5:]]
    assert without_initial_values("".join(parts), (8,)) == "".join(kept)
