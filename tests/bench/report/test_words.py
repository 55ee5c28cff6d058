"""The section on word lengths: every word that it names is a word of the models."""

import numpy as np
import pytest

from blysk.bench.report import words
from blysk.bench.report.section import Drawing, Table
from blysk.bench.report.short_words import measure_short
from blysk.bench.report.words import METHODS, MOST_DROPPED, error_of, section, shortest, tasks

SIZE, RANDOM = (40, 30), 24


def test_bits_that_can_go():
    found = [{"diffuse": 0.1, "10": 0.2}, {"diffuse": 0.105, "10": 0.2}, {"diffuse": 0.1, "10": 0.3}]
    assert shortest(found) == 1
    assert shortest(found[:2]) == 1
    assert shortest([{"10": 0.0}, {"10": 1.0}]) == 0


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("method", METHODS)
def test_every_word_counts_once_it_is_short(method):
    """A word that no model reads under its name would never count."""
    whole = error_of(method, {}, SIZE, RANDOM)
    assert all(0.001 < error < 0.45 for error in whole.values())
    for word in METHODS[method]:
        dropped = _PARTS.get(word.name, word.bits - 3)
        cut = error_of(method, {word.name: dropped}, SIZE, RANDOM)
        assert any(error > 2 * whole[name] for name, error in cut.items()), word.name


_PARTS = {"P of u": 7, "G": 14, "P of f": 14, "slope": 11}
"""Bits of words that cannot be cut down to three bits."""


@pytest.mark.long
def test_section_of_made_up_results():
    whole = {"diffuse": 0.01, "10": 0.02, "100": 0.03, "1000": 0.04}
    growing = [
        {name: error * 2**dropped for name, error in whole.items()} for dropped in range(MOST_DROPPED + 1)
    ]
    chosen = tasks(quick=True)
    flat = [dict(whole) for _ in growing]
    results = [
        {"triangles": 992, "errors": [1.0, 2.0, 3.0]}
        if task.function is measure_short
        else flat
        if task.settings["word"] == "place"
        else growing
        for task in chosen
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(words, "error_of", lambda *_: whole)
        found = section(chosen, results)
    assert sum(isinstance(part, Table) for part in found.parts) == len(METHODS) + 1
    assert found.parts[-1].rows[0] == ["12 bits", "teapot", 992, 1.0, 2.0, 3.0]
    assert sum(isinstance(part, Drawing) for part in found.parts) == len(METHODS)
    assert f"place by {MOST_DROPPED}." in found.text[1]
    free = {row["word"]: row["bits that can go"] for row in found.parts[1].records()}
    assert free["place"] == MOST_DROPPED
    assert np.all([free[word.name] == 0 for word in METHODS["quotient"] if word.name != "place"])
