"""Statements of the paper: each is in its text, and is refused if the figures or the pages are others."""

import copy
import re

import pytest

from blysk.bench.quality import paper_claims as module
from blysk.bench.quality.paper import SOURCE, data_of
from blysk.bench.quality.paper_claims import CLAIMS, REPEATED, check
from blysk.sim.errors import InputError

from .test_paper import measured

TEXT = SOURCE.read_text(encoding="utf-8")


@pytest.fixture
def data():
    """Made-up data that bear out every claim. A test may change them."""
    return copy.deepcopy(data_of(measured()))


def test_true_statements_pass(data):
    check(data, TEXT)


def rival(data, name):
    return next(row for row in data["rivals"]["rows"] if row["method"] == name)


CHANGES = {
    "two tables and 11 products": lambda data: data["design"].update(multipliers=17),
    "more than 18 bits": lambda data: data["lights"]["rows"][0].update(widest=19),
    "a pixel in each cycle": lambda data: rival(data, "quotient").update(cycles=[1, 1.00001]),
    "13 multipliers": lambda data: data["lights"]["rows"][0].update(multipliers=[16, 29, 55, 108]),
    "No row is at least as good": lambda data: data["methods"].append(data["design"] | {"cycles": 0.9}),
    "From two lights on": lambda data: data["more_lights"]["rows"][0].reverse(),
    "more multipliers, and": lambda data: data["renormalise"].update(multipliers=16),
    "a netlist with one light confirms": lambda data: rival(data, "quotient").update(netlist=17),
    "the count may be too low": lambda data: rival(data, "quotient").update(multipliers=[16, 107]),
    "and as exact": lambda data: rival(data, "duff").update(errors=[0.25, 0.3]),
}
"""A change of the data for each claim, by words of the claim."""


@pytest.mark.parametrize("words", CHANGES)
def test_an_untrue_claim_is_refused(words, data):
    CHANGES[words](data)
    with pytest.raises(InputError, match="the figures of the report are others") as found:
        check(data, TEXT)
    assert words in found.value.thing


def test_every_claim_can_be_untrue():
    refused = {said for said in CLAIMS for words in CHANGES if words in said}
    assert refused == CLAIMS.keys()


def test_a_changed_sentence_is_refused(data):
    for said in (*CLAIMS, *REPEATED):
        text = " ".join(TEXT.split()).replace(said, "")
        with pytest.raises(InputError, match="the paper does not say this"):
            check(data, text)


def test_a_changed_page_is_refused(data, monkeypatch):
    said, (page, words) = next(iter(REPEATED.items()))
    monkeypatch.setattr(module, "REPEATED", {said: (page, f"{words} and more")})
    with pytest.raises(InputError, match="does not say"):
        check(data, TEXT)


def test_typst_reads_no_mark_of_the_text_as_its_own():
    """A number with a point begins a list at the start of a line. A semicolon behind a value is left out."""
    assert not re.search(r"^\s*\d+\. |#[\w.()-]+;", TEXT, re.MULTILINE)
