"""The accuracy table: it measures what it prints."""

from pathlib import Path

import pytest

from bench.accuracy import DESIGNS, main, measure, row
from golden.pipeline import METHODS, ShadingPipeline
from sim.teapot import teapot


def test_measures_every_exponent():
    rows = list(measure(teapot(500), ShadingPipeline(), (1, 100), 64, 48))
    assert [row[0] for row in rows] == [1, 100]
    first, second = (row[1] for row in rows)
    assert first.pixels == second.pixels > 500
    assert (first.image != second.image).any()
    for _, _, result in rows:
        assert 0 < result.arithmetic_error.max_lsb <= 1
        assert result.total_error.max_lsb > 5


def assert_in_readme(line):
    # The last column is a time.
    assert line.rsplit("|", 2)[0] in (Path(__file__).parents[2] / "README.md").read_text()


def test_readme_states_what_is_measured():
    assert_in_readme(row("teapot", teapot(10_000), ShadingPipeline("chord")))


@pytest.mark.long
def test_readme_states_all_that_is_measured(capsys):
    assert main([]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + len(DESIGNS)
    assert {method for method, _ in DESIGNS} == set(METHODS)
    for line in lines:
        assert_in_readme(line)


def test_bad_mesh_is_one_line(capsys):
    assert main(["missing.obj"]) == 2
    assert capsys.readouterr().err.startswith("bench.accuracy: missing.obj: ")
