"""Fixtures of proofs: prove and refute claims of a harness, inject bugs, check wraps."""

import inspect
import textwrap

import pytest

from blysk.golden.number.fixed import Fixed, Format

from .bounds import Bounds
from .prover import expect, missing_tool
from .rules import never_resumes


@pytest.fixture
def prove(decided, tmp_path):
    """Prove the claims of a harness, for runs of any length, or for some cycles from power-up.

    The number of cycles must be large enough. In this time a beat must be able to wait, a second beat to
    come, and the first beat to leave.
    """
    if missing_tool():
        pytest.skip(missing_tool())

    def prove(harness, cycles=None):
        verdict = expect(True, harness, tmp_path, cycles, decided=decided)
        assert verdict.holds is not None, f"not decided in time, after {verdict.cycles} cycles"
        assert verdict.holds, f"refuted after {verdict.cycles} cycles:\n{verdict.trace}"
        if cycles is not None:
            runs = harness.without_claims()
            never_resumes(runs)
            moves = expect(False, runs, tmp_path, cycles, decided=decided)
            assert moves.holds is False, f"nothing moves on in {cycles} cycles"

    return prove


@pytest.fixture
def refute(decided, tmp_path):
    """Find a counterexample to the claims of a harness with an injected bug, within some cycles."""
    if missing_tool():
        pytest.skip(missing_tool())

    def refute(harness, cycles=40):
        verdict = expect(False, harness, tmp_path, cycles, decided=decided)
        assert verdict.holds is False, f"no counterexample in {verdict.cycles} cycles"

    return refute


@pytest.fixture
def inject(monkeypatch):
    """Inject a bug: replace a function by a copy in which a piece of text is changed."""

    def inject(owner, name, text, bug):
        function = getattr(owner, name)
        source = textwrap.dedent(inspect.getsource(function))
        assert source.count(text) == 1, f"{name} has {text!r} {source.count(text)} times, not once"
        namespace = dict(inspect.unwrap(function).__globals__)
        exec(source.replace(text, bug), namespace)
        monkeypatch.setattr(owner, name, namespace[name])

    return inject


@pytest.fixture
def wraps(monkeypatch):
    """Formats in which a model wraps or makes words. The fixture fails if a format may not hold a code.

    The results of all other operations have formats that hold every result, or saturate.
    """
    found, wrap, new = [], Format.wrap, Fixed.__init__

    def checked(format, codes):
        found.append(format)
        bounds = codes if isinstance(codes, Bounds) else Bounds(codes.min(), codes.max())
        assert bounds.within(format.min_code, format.max_code), (
            f"{bounds.low.min():.0f} to {bounds.high.max():.0f} wraps in {format}"
        )
        return codes if isinstance(codes, Bounds) else wrap(format, codes)

    def made(number, format, codes):
        if not isinstance(codes, Bounds):
            return new(number, format, codes)
        found.append(format)
        assert codes.within(format.min_code, format.max_code), f"a word wraps in {format}"
        number.format, number.codes = format, codes

    monkeypatch.setattr(Format, "wrap", checked)
    monkeypatch.setattr(Fixed, "__init__", made)
    return found
