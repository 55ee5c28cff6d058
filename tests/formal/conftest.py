"""What proofs share: a folder for the netlist, and verdicts that say what they found."""

import inspect
import textwrap

import pytest

from .prover import decide, missing_tool


@pytest.fixture
def prove(tmp_path):
    """Prove the claims of a harness, for runs of any length, or of so many clocks from power-up."""
    if missing_tool():
        pytest.skip(missing_tool())

    def prove(harness, clocks=None):
        verdict = decide(harness, tmp_path, clocks)
        assert verdict.holds is not None, f"not decided in time, after {verdict.clocks} clocks"
        assert verdict.holds, f"refuted after {verdict.clocks} clocks:\n{verdict.trace}"

    return prove


@pytest.fixture
def refute(tmp_path):
    """Find a counterexample to the claims of a harness, of at most so many clocks; the planted bug's."""
    if missing_tool():
        pytest.skip(missing_tool())

    def refute(harness, clocks=40):
        verdict = decide(harness, tmp_path, clocks)
        assert verdict.holds is False, f"no counterexample in {verdict.clocks} clocks"

    return refute


@pytest.fixture
def plant(monkeypatch):
    """Plant a bug: put a copy of a function in its place, in which one piece of text is another."""

    def plant(owner, name, text, bug):
        function = getattr(owner, name)
        source = textwrap.dedent(inspect.getsource(function))
        assert source.count(text) == 1, f"{name} has {text!r} {source.count(text)} times, not once"
        namespace = dict(inspect.unwrap(function).__globals__)
        exec(source.replace(text, bug), namespace)
        monkeypatch.setattr(owner, name, namespace[name])

    return plant
