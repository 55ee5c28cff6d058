"""Claims of the documents: each is measured, its verdict is checked; the table of claims."""

import json
import math
from dataclasses import replace

import pytest

from blysk.bench.report import cosine_quadratic, errata, phong_blinn, thesis
from blysk.bench.report.claims import Claim, ClaimTable, Document, at_least, measured, to_the_digits
from blysk.bench.report.section import Section

NOT_AS_PRINTED = {
    "fQ (Q = 0.64), largest relative error in the zone, %",
    "fQ2, largest relative error in the zone, %",
}


def verdicts(claims):
    """Verdicts by quantity, for claims that have a printed value."""
    results = json.loads(json.dumps(measured(claims)))
    found = [(claim.quantity, claim.verdict(result)) for claim, result in zip(claims, results, strict=True)]
    return {quantity: verdict for quantity, verdict in found if verdict is not None}


def test_errata_do_not_come_out():
    """The zone is an exception, because it is chosen so that its figure comes out."""
    found = verdicts(errata.CLAIMS)
    assert {quantity for quantity, verdict in found.items() if verdict} == {
        "largest relative error of f2 in the zone"
    }
    # Quantities that two entries share count once.
    assert len(found) == len({claim.quantity for claim in errata.CLAIMS})


def test_figures_of_the_cosine_quadratic():
    found = verdicts(cosine_quadratic.claims(quick=True))
    assert len(found) == len(cosine_quadratic.PUBLISHED)
    assert {quantity for quantity, verdict in found.items() if not verdict} == NOT_AS_PRINTED


def test_counts_and_exponents_of_phong_and_blinn():
    """There are fewer operations if H is the frame's.

    The ratio is about 4 along the plane of L and V, and across it only for L = V.
    """
    claims = [claim for claim in phong_blinn.claims(quick=True) if not claim.timed]
    found = verdicts(claims)
    assert len(found) == 1 + 2 + 16
    assert {quantity for quantity, verdict in found.items() if not verdict} == {
        "operations saved: Blinn, L and V are each pixel's, %",
        *(
            f"over n, for the same half-width across the plane of L and V, n = {n}, a = {degrees}"
            for n in (10, 1000)
            for degrees in (30, 60, 75)
        ),
    }


@pytest.mark.long
def test_speeds_in_hardware():
    """Both ways give a normal a cycle. A step counts in MNSE by its place."""
    claims = [claim for claim in thesis.claims(quick=True) if not claim.timed]
    found = verdicts(claims)
    assert len(found) == 5 + 1
    assert not any(found.values())


@pytest.mark.parametrize("document", [thesis, phong_blinn])
def test_times_have_a_verdict(document):
    """The verdict depends on the machine."""
    of_kind = {(c.function, c.key): c for c in document.claims(quick=True) if c.timed}
    claims = [replace(claim, settings={**claim.settings, "repeats": 1}) for claim in of_kind.values()]
    for claim, result in zip(claims, measured(claims), strict=True):
        assert math.isfinite(claim.values(result)[1])
        assert (claim.verdict(result) is None) == (not claim.printed)


@pytest.mark.parametrize(
    ("holds", "printed", "inside", "outside"),
    [
        (to_the_digits, "0.162", (0.1616, 0.16249), (0.1614, 0.1626)),
        (to_the_digits, "2", (1.6, 2.4), (1.4, 2.6)),
        (at_least, "2.4", (2.4, 9), (2.39, -3)),
        (at_least, "0.20 to 0.35", (0.2, 0.5), (0.19, 0)),
    ],
)
def test_verdicts(holds, printed, inside, outside):
    assert all(holds(printed, value) for value in inside)
    assert not any(holds(printed, value) for value in outside)


def half(of):
    return {"half": of / 2, "of": of}


def both():
    return 1.0, 1.001


def test_the_table_of_claims():
    """Columns have an entry.

    Claims that share a measurement have one measurement, and a verdict on both values.
    """
    claims = [
        Claim("[X] 1", "it is half", "half, %", half, {"of": 0.5}, "half", printed="25"),
        Claim("[X] 1", "it is half", "whole", half, {"of": 0.5}, "of"),
        Claim("[X] 2", "elsewhere", "half", half, {"of": 3}, "half", printed="1.4"),
    ]
    tables = [
        ClaimTable("x", "X", lambda quick: claims[:2] if quick else claims, "Note.", {"of what": "of"}),
        ClaimTable("y", "Y", lambda quick: [Claim("[Y]", "", "one", both), Claim("[Z]", "said", "rate")]),
    ]
    document = Document("name", "Title", ["Text."], tables)
    for quick, count in ((True, 2), (False, 3)):
        tasks = document.tasks(quick)
        assert len(tasks) == count
        made = document.section(tasks, json.loads(json.dumps([task.run() for task in tasks])))
        assert isinstance(made, Section)
        assert made.text[0] == "Text."
        assert made.text[1].startswith(f"2 of {count} printed values come out as printed.")
        first, second = made.parts
        assert first.columns == [
            "source",
            "stated",
            "quantity",
            "printed",
            "measured",
            "as printed",
            "of what",
        ]
        assert first.rows[0] == ["[X] 1", "it is half", "half, %", "25", 25.0, True, 0.5]
        assert first.rows[1][3:] == [None, 0.5, None, 0.5]
        assert [row[-2] for row in first.grades] == ["good", "", "bad"][:count]
        assert len(first.rows) == count
        assert second.records()[0]["printed"] == 1.0
        assert second.rows[1] == ["[Z]", "said", "rate", None, None, None]
