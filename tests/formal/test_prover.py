"""Statements that were decided before are recognised by their digest; all others are decided."""

import pytest
from amaranth.hdl import Mux, Signal, unsigned

from ..decided import Decided
from .prover import Harness, expect, missing_tool

pytestmark = [pytest.mark.prove, pytest.mark.skipif(bool(missing_tool()), reason=missing_tool())]


def of_counter(last):
    """A counter from 0 to 5, with the claim that it does not pass a number."""
    harness = Harness()
    count = Signal(unsigned(3))
    harness.m.d.sync += count.eq(Mux(count == 5, 0, count + 1))
    harness.claim(count <= last)
    return harness


def test_what_was_decided_is_known_and_nothing_else(tmp_path):
    first = Decided([])
    assert expect(True, of_counter(5), tmp_path, decided=first).holds is True
    assert (tmp_path / "top.aig").is_file()
    for k, (harness, cycles) in enumerate([(of_counter(5), None), (of_counter(4), None), (of_counter(5), 4)]):
        (folder := tmp_path / str(k)).mkdir()
        verdict = expect(True, harness, folder, cycles, decided=Decided(first.used))
        assert verdict.holds is (k != 1)
        # Only statements that are not known are decided.
        assert any(folder.iterdir()) == (k != 0)


def test_a_verdict_that_is_not_expected_is_not_kept(tmp_path):
    decided = Decided([])
    assert expect(True, of_counter(4), tmp_path, decided=decided).holds is False
    assert not decided.used
    assert expect(False, of_counter(4), tmp_path, decided=decided).holds is False
    assert expect(True, of_counter(4), tmp_path, decided=Decided(decided.used)).holds is False
