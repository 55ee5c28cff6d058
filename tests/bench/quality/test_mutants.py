"""Mutants: known faults and known equivalents, scores, the list of reasons, bad input."""

import pytest

from blysk.bench.quality import mutants
from blysk.bench.quality.mutants import DEVICES, LEAST, Score, main, scores, table
from blysk.sim.frames.workers import local_executor

ROWS = [
    Score("one", 10, ("a", "b"), ("c", "d")),
    Score("two", 5, ("a",), ()),
    Score("three", 3, ("a", "b", "c"), ()),
]


@pytest.fixture(scope="module")
def diffuse_vectors():
    return mutants.vectors_of("diffuse")


def measured(names, count=mutants.COUNT):
    with local_executor(2) as executor:
        return scores(names, count, executor=executor)


def test_score_leaves_the_equivalent_out():
    assert [row.killed for row in ROWS] == [6, 4, 0]
    assert [row.score for row in ROWS] == [6 / 8, 1, 1]


def test_table_has_a_line_a_device():
    assert table(ROWS).splitlines()[2:] == [
        "| one | 10 | 2 | 6 | 2 | 75.0% |",
        "| two | 5 | 1 | 4 | 0 | 100.0% |",
        "| three | 3 | 3 | 0 | 0 | 100.0% |",
    ]


def test_survivors_want_a_reason(monkeypatch):
    monkeypatch.setattr(mutants, "_argued", lambda: {"one": {"c": "for a reason"}, "two": {"d": "another's"}})
    assert ROWS[0].open == ("d",)


def test_proofs_tell_faults_from_the_unit(tmp_path, diffuse_vectors):
    """No killed mutant is equivalent, and the unit is equivalent to itself."""
    unit = DEVICES["diffuse"].unit()
    known = mutants._mutate(unit, "", 20, 3, tmp_path)
    killed = mutants._killed(mutants._Mutants(unit, tmp_path), diffuse_vectors, known)
    miter = mutants._Miter(tmp_path)
    assert len(killed) > 10
    assert [miter.is_equivalent(mutant) for mutant in sorted(killed)] == [False] * len(killed)
    assert miter.is_equivalent(0)


def test_vectors_are_those_of_the_tests(diffuse_vectors):
    """The same beats without stalls, with three kinds of them, and few."""
    stimuli = [stimulus for stimulus, _ in diffuse_vectors]
    lengths = [len(stimulus.input) for stimulus in stimuli]
    assert (min(lengths), len(set(lengths)), len(stimuli)) == (60, 2, 10)
    assert sum(not (s.input_stalls.any() or s.output_stalls.any()) for s in stimuli) == 1


@pytest.mark.long
def test_small_device():
    (row,) = measured(["diffuse"], 60)
    assert row.mutants > 50
    assert row.score >= LEAST
    assert not row.open


@pytest.mark.long
@pytest.mark.parametrize("device", DEVICES)
def test_mutants_are_killed(device):
    (row,) = measured([device])
    assert row.score >= LEAST
    assert not row.open
    # Nothing is argued that is killed; a quick machine may prove what another has to argue.
    assert set(mutants._argued().get(device, {})) <= {*row.survived, *row.equivalent}


def test_bad_input_is_told_in_one_line(capsys, tmp_path):
    assert main(["tea"]) == 2
    assert capsys.readouterr().err.startswith(
        "blysk.bench.quality.mutants: tea: is no device; choose from dot_product, "
    )
    assert main(["--count", "0"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert main(["diffuse", "--json", str(tmp_path)]) == 2
    assert (
        capsys.readouterr().err
        == f"blysk.bench.quality.mutants: {tmp_path}: cannot be written, it is a folder; "
        "give the name of a file\n"
    )
