"""Mutants: known faults and known equivalents, scores, waivers, bad input."""

import re
from dataclasses import replace

import pytest

from blysk.bench.quality import equivalence, mutation_score
from blysk.bench.quality.equivalence import Miter
from blysk.bench.quality.mutants import COUNT, LEAST, SEED, main
from blysk.bench.quality.mutation import Mutants, killed, mutate, vectors_of
from blysk.bench.quality.mutation_score import Score, scores, table, waived
from blysk.bench.units.registry import RECORDS
from blysk.sim.frames.workers import local_executor

ROWS = [
    Score("diffuse", 10, ("a", "b"), ("c", "d")),
    Score("factor", 5, ("a",), ()),
    Score("serialiser", 3, ("a", "b", "c"), ()),
]


def test_score_leaves_the_equivalent_out():
    assert [row.killed for row in ROWS] == [6, 4, 0]
    assert [row.score for row in ROWS] == [6 / 8, 1, 1]
    assert table(ROWS).splitlines()[2:] == [
        "| diffuse | 10 | 2 | 6 | 0 | 2 | 75.0% |",
        "| factor | 5 | 1 | 4 | 0 | 0 | 100.0% |",
        "| serialiser | 3 | 3 | 0 | 0 | 0 | 100.0% |",
    ]


def test_waivers_are_of_a_signal_and_its_copies(monkeypatch):
    record = replace(RECORDS["diffuse"], waivers={"datapath.sum": "for a reason", "last_?": "for another"})
    monkeypatch.setitem(mutation_score.RECORDS, "diffuse", record)
    for signal in ("unit.datapath.sum", "unit.datapath.sum_3", "unit.inner.datapath.sum", "unit.last_1"):
        assert waived("diffuse", f"stuck-at-0 -> {signal}")
    for signal in ("unit.datapath.summand", "unit.sum", "unit.last"):
        assert not waived("diffuse", f"stuck-at-0 -> {signal}")
    row = Score("diffuse", 3, (), ("inv -> unit.last_1", "inv -> unit.other"))
    assert row.open == ("inv -> unit.other",)
    assert (row.waived, row.score) == (1, 1 / 2)


@pytest.mark.parametrize(("survivors", "status"), [(10, 0), (11, 1)])
def test_status_tells_whether_the_score_is_reached(monkeypatch, capsys, survivors, status):
    row = Score("diffuse", 200, (), tuple(f"inv -> unit.o{k}" for k in range(survivors)))
    monkeypatch.setattr(mutation_score, "scores", lambda *_: [row])
    assert main(["diffuse"]) == status
    assert capsys.readouterr().err.count("survived without a waiver: diffuse: inv -> unit.o") == survivors


@pytest.mark.long
def test_controls_that_a_memory_lacks_are_left_alone(tmp_path):
    """Before mapping, the ports of a memory have neither clock nor reset.

    Yosys refuses other values there.
    """
    record = RECORDS["texel_memory"]
    known = mutate(record.variants[record.default].unit(), 200, SEED, tmp_path)
    assert not [mutant for mutant in known.values() if re.search(r"memrd\S* ([AS]RST|EN)\[", mutant)]
    assert [mutant for mutant in known.values() if "memrd" in mutant]


@pytest.mark.long
def test_proofs_tell_faults_from_the_unit(tmp_path):
    """No killed mutant is equivalent to the unit, and the unit is equivalent to itself."""
    record = RECORDS["diffuse"]
    unit = record.variants[record.default].unit()
    known = mutate(unit, 20, 3, tmp_path)
    found = killed(Mutants(unit, tmp_path), vectors_of(record)[:3], known)
    miter = Miter(tmp_path)
    assert len(found) > 10
    assert not any(miter.is_equivalent(mutant) for mutant in sorted(found)[:5])
    assert miter.is_equivalent(0)


def test_more_mutants_than_yosys_lists_at_once(tmp_path):
    """If Yosys is asked for 200 mutants of this unit's few cells at once, it never ends."""
    record = RECORDS["plane_assembler"]
    known = mutate(record.variants[record.default].unit(), 200, 7, tmp_path)
    assert 150 < len(known) <= 200
    commands = (tmp_path / "mutants.txt").read_text().splitlines()
    assert [f"mutate -ctrl mutant 8 {number} " for number in known] == [
        re.match(r"mutate -ctrl mutant 8 \d+ ", command)[0] for command in commands
    ]
    assert len({re.sub(r"8 \d+ ", "", command) for command in commands}) == len(commands)


@pytest.mark.long
def test_units_of_three_gates_have_mutants(monkeypatch, tmp_path):
    """A cell that only names a part inside does not count.

    With it more mutants were requested than Yosys can list.
    """
    monkeypatch.setattr(equivalence, "YOSYS_SECONDS", 60)
    record = RECORDS["bisection_interpolator"]
    known = mutate(record.variants[record.default].unit(), 200, 7, tmp_path)
    assert len((tmp_path / "own.txt").read_text().splitlines()) == 3
    assert 10 < len(known) < 50


@pytest.mark.long
def test_a_register_that_starts_at_1_and_stays_may_be_left_out(tmp_path):
    """The register is that of the dot product's ready.

    A fault removes its initial value, which nobody reads.
    """
    record = RECORDS["bisection_chain"]
    mutate(record.variants[record.default].unit(), 200, 7, tmp_path)
    assert Miter(tmp_path).is_equivalent(0)


@pytest.mark.long
def test_faults_of_high_bits_of_counters_are_killed(tmp_path):
    """No run from 0 reaches these bits, because a run has fewer than 2^9 events."""
    record = RECORDS["triangle_assembly"]
    unit = record.variants[record.default].unit()
    known = mutate(unit, 200, 7, tmp_path)
    high = {k for k, name in known.items() if re.match(r"const0 \$add A\[(9|[1-3]\d)\] -> status", name)}
    model, vectors = Mutants(unit, tmp_path), vectors_of(record)
    assert len(high) >= 4
    assert killed(model, vectors, high) == high
    model.counters = []
    assert not killed(model, vectors, high)


@pytest.mark.long
def test_mutants_are_killed():
    """Mutants of a small unit. ``make mutants`` takes all units."""
    with local_executor(1) as executor:
        (row,) = scores(["diffuse"], COUNT, SEED, executor)
    assert row.score >= LEAST
    assert not row.open


def test_bad_input_is_told_in_one_line(capsys, tmp_path):
    name = "blysk.bench.quality.mutants"
    for arguments, text in (
        (["tea"], f"{name}: tea: is not a unit; choose from "),
        (["--count", "0"], f"{name}: "),
        (["diffuse", "--json", str(tmp_path)], f"{name}: {tmp_path}: cannot be written, it is a folder; "),
    ):
        assert main(arguments) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(text)
