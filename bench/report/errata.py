"""The report's section on errata: the documents' statements, what comes out, and computed evidence."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from blysk.bench.report.cosine_quadratic_figures import ZONE
from blysk.bench.report.errata_evidence import (
    Evidence,
    arccos_at_one,
    arccos_claim,
    energy,
    extrapolated_end,
    factor_claim,
    flat_picture,
    held_root,
    inverted_test,
    mirror,
    misprint,
    octaves,
    order,
    quadratic_length,
    recurrence,
    root_claim,
    root_least,
    scaled_in_place,
    second_lobe,
    shortcut,
    undefined_zone,
    worked_example,
    wrong_variable,
    zone_bounds,
)
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task

__all__ = [
    "ERRATA",
    "KINDS",
    "OWN",
    "Erratum",
    "Unmatched",
    "evidence",
    "matters",
    "section",
    "tasks",
]


KINDS = {
    "slip": "a slip in print, drawing or listing",
    "figure": "a figure that does not come out of the printed digits",
    "unclear": "not defined, or readable in two ways",
    "reading": "perhaps marks lost when a machine read the text that we have, and no error of the authors",
    "form": "no error: a form or a choice that is good in its range, and that our units replace",
}
"""What an entry is, and what it is not."""


@dataclass(frozen=True)
class Erratum:
    """A statement of a document that does not come out, or that the units replace; and evidence.

    Parameters
    ----------
    place : str
        Document and place.
    kind : str
        One of `KINDS`.
    published, right : str
        The published statement, and what comes out or replaces it.
    quantity : str
        Name of the computed quantity, with its unit.
    evidence : callable
        Computes the quantity twice: by the published and by the right statement.
    matter : str, optional
        What entries about the same matter share; an entry without is a matter of its own.
    """

    place: str
    kind: str
    published: str
    right: str
    quantity: str
    evidence: Callable[[], Evidence]
    matter: str = ""


@dataclass(frozen=True)
class Unmatched:
    """A figure stated for the project that cannot be reproduced, or not to all of its digits.

    Parameters
    ----------
    what : str
        The figure.
    stated : str
        The figure as stated.
    found : str
        The finding, in words.
    values : callable
        Computes the figure as stated, and another that explains it.
    """

    what: str
    stated: str
    found: str
    values: Callable[[], Evidence]


ERRATA = {
    "arccos-misprint": Erratum(
        "[T] table 3.1, last row",
        "slip",
        "74.547",
        "74.457",
        "error of the polynomial at x = 0.96, rad",
        misprint,
    ),
    "arccos-order": Erratum(
        "[T] table 3.1, columns A, B, C",
        "unclear",
        "columns A, B, C, which A x^2 + B x + C would fit, too",
        "A + B x + C x^2",
        "largest error on [0, 0.5], rad",
        order,
    ),
    "arccos-claim": Erratum(
        "[T] table 3.1, error",
        "figure",
        "0.2 %, read as that of every row",
        "more on [0.75, 0.96], by its own digits",
        "largest relative error on [0, 0.96]",
        arccos_claim,
    ),
    "arccos-one": Erratum(
        "[T] 3.2",
        "form",
        "a quadratic on [0.96, 1]",
        "sqrt(1 - x) times a polynomial, or the half chord: arccos has a root's slope at 1",
        "largest error on [0.96, 1], corrected, rad",
        arccos_at_one,
    ),
    "root-1": Erratum(
        "[T] 2.1, degree 1",
        "figure",
        "0.64 - 0.07 z: 0.12 %",
        "0.12 % is that of the coefficients before they were rounded",
        "largest relative error on [sqrt 2, 2]",
        lambda: root_claim(1, 0.0012, relative=True),
        "digits-2.1",
    ),
    "root-1-least": Erratum(
        "[T] 2.1, degree 1",
        "figure",
        "0.0005",
        "no line has less than 6.1e-4",
        "largest error on [sqrt 2, 2]",
        root_least,
        "digits-2.1",
    ),
    "root-2": Erratum(
        "[T] 2.1, degree 2",
        "figure",
        "0.014 z^2 - 0.119 z + 0.681: 2e-5, 0.004 %",
        "both are those of the coefficients before they were rounded",
        "largest error on [sqrt 2, 2]",
        lambda: root_claim(2, 2e-5),
        "digits-2.1",
    ),
    "factor-3": Erratum(
        "[T] 2.2, h of degree 3",
        "figure",
        "0.00038, 0.054 %",
        "both are those of the coefficients before they were rounded",
        "largest error, r from 0 to 1",
        factor_claim,
    ),
    "second-lobe": Erratum(
        "[T] figure 3.6",
        "slip",
        "the comparator is behind the square",
        "compare the base, before it is squared",
        "highlight at n = 20, gamma = 60 degrees",
        second_lobe,
    ),
    "shortcut-10": Erratum(
        "[T] 3.3",
        "form",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1, near for small psi",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 10 degrees",
        lambda: shortcut(10),
        "shortcut",
    ),
    "shortcut-60": Erratum(
        "[T] 3.3",
        "form",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1, near for small psi",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 60 degrees",
        lambda: shortcut(60),
        "shortcut",
    ),
    "recurrence-64": Erratum(
        "[T] figure 3.5",
        "form",
        "x(t+1) = 2 cos d x(t) - x(t-1), exact but for rounding",
        "Reinsch's form",
        "worst error: 64 pixels, 10 degrees, 16 fraction bits",
        lambda: recurrence(64, 10, 16),
        "recurrence",
    ),
    "recurrence-256": Erratum(
        "[T] figure 3.5",
        "form",
        "x(t+1) = 2 cos d x(t) - x(t-1), exact but for rounding",
        "Reinsch's form",
        "worst error: 256 pixels, 60 degrees, 16 fraction bits",
        lambda: recurrence(256, 60, 16),
        "recurrence",
    ),
    "recurrence-4095": Erratum(
        "[T] figure 3.5",
        "form",
        "x(t+1) = 2 cos d x(t) - x(t-1), exact but for rounding",
        "Reinsch's form",
        "worst error: 4095 pixels, 60 degrees, 24 fraction bits",
        lambda: recurrence(4095, 60, 24),
        "recurrence",
    ),
    "worked-example": Erratum(
        "[T] 4.1, worked example",
        "slip",
        "0.3445, with 0.0015 for the highlight, as 0.577^10 = 0.003 would give",
        "0.577^10 is 0.0041",
        "intensity",
        worked_example,
    ),
    "mnse": Erratum(
        "[T] 4.1, MNSE",
        "form",
        "each error divided by its own pixel's distance from the mean",
        "sum of errors over sum of distances (NMSE)",
        "share of a flat picture's values with a defined figure",
        flat_picture,
    ),
    "inverted": Erratum(
        "[T] appendix В",
        "slip",
        "Phong where normals are close",
        "Gouraud where they are close",
        "share of the triangles of a teapot of 992 that the test of normals gives to Gouraud",
        inverted_test,
    ),
    "extrapolated": Erratum(
        "[T] appendix Г, NormalVector",
        "slip",
        "the end is extrapolated without the start vector",
        "N_l + g (N_r - N_l)",
        "error of the last normal, 10 degrees, 6 pixels",
        extrapolated_end,
    ),
    "scaled": Erratum(
        "[T] appendix Г, NormalVector",
        "slip",
        "dN is scaled in place at every pixel, from i = 0 on; read as by i/(m - 1)",
        "a scaled copy, dN itself kept",
        "error of the last normal, 10 degrees, 6 pixels",
        scaled_in_place,
    ),
    "variable": Erratum(
        "[T] appendix Д",
        "slip",
        "P[1]*x in green",
        "P[1]*y",
        "error of green at a corner whose value is given, intensities 0.2, 0.4, 0.9",
        wrong_variable,
    ),
    "energy-phong": Erratum(
        "[C], Phong's normalising coefficient",
        "reading",
        "(n+2)/2n",
        "(n+2)/(2 pi)",
        "reflected energy at n = 10, to be 1",
        lambda: energy("phong", 10),
        "normalising",
    ),
    "energy-blinn": Erratum(
        "[C], Blinn's normalising coefficient",
        "reading",
        "((n+2)(n+4))/(8n(2^(n/2)+n))",
        "((n+2)(n+4))/(8 pi (2^(-n/2)+n))",
        "reflected energy at n = 10, to be 1",
        lambda: energy("blinn", 10),
        "normalising",
    ),
    "mirror": Erratum(
        "[C], mirror direction",
        "reading",
        "R = 2 (L x N) x N - L",
        "R = 2 (L·N) N - L: products are scalar",
        "length of R, to be 1",
        mirror,
    ),
    "zone": Erratum(
        "[C], epicentre zone",
        "unclear",
        "7.924 %, of a zone that is not defined",
        f"where Blinn's model is at least {ZONE}",
        "largest relative error of f2 in the zone",
        undefined_zone,
    ),
}
"""What the documents print, by name."""

OWN = {
    "octaves": Unmatched(
        "arccos in octaves of 1 - x, largest error, rad",
        "1.7e-4",
        "quadratics give the first, cubics the second",
        octaves,
    ),
    "zone": Unmatched(
        "[C]'s zone, 7.924 %: Blinn at least",
        "0.594",
        "0.594 gives the first; the second is the bound of 7.924 %",
        zone_bounds,
    ),
    "quadratic-length": Unmatched(
        "length error of a quadratic normal at 45 degrees",
        "7.3e-4",
        "the first, at the place in the span that is the second",
        quadratic_length,
    ),
    "held-root": Unmatched(
        "1/sqrt(2+z) exact at angle 0, 3 terms, largest error",
        "7.9e-7",
        "the coefficients shown give the first, the best ones the second",
        held_root,
    ),
}
"""Stated figures that do not come out, by name."""


def matters() -> dict[str, int]:
    """Number of different matters of `ERRATA` of each kind, in the order of `KINDS`."""
    found = {(erratum.kind, erratum.matter or name) for name, erratum in ERRATA.items()}
    return {kind: sum(one == kind for one, _ in found) for kind in KINDS}


def evidence(own: bool) -> dict[str, list[float]]:
    """Compute the evidence of each entry.

    Parameters
    ----------
    own : bool
        Whether of `OWN`, else of `ERRATA`.

    Returns
    -------
    dict
        By name, two figures: see `Erratum` and `Unmatched`.
    """
    if own:
        return {name: list(figure.values()) for name, figure in OWN.items()}
    return {name: list(erratum.evidence()) for name, erratum in ERRATA.items()}


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section: the same whether quick or not."""
    return [Task(evidence, {"own": own}) for own in (False, True)]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks."""
    documents, own = results
    errata = Table(
        "errata",
        "Errata of the documents",
        ("place", "kind", "published", "right", "computed", "as published", "as it should be"),
        [[e.place, e.kind, e.published, e.right, e.quantity, *documents[name]] for name, e in ERRATA.items()],
        "Kinds: "
        + "; ".join(f"{kind}, {meaning}" for kind, meaning in KINDS.items())
        + ". Both figures are computed by this report, but for those that a document claims itself (an "
        "error, an intensity), which stand as published. Listings of [T] are as docs/theory/errata.md "
        "describes them.",
    )
    figures = Table(
        "errata-stated",
        "Figures stated for this project that do not come out",
        ("figure", "stated", "found", "first", "second"),
        [[figure.what, figure.stated, figure.found, *own[name]] for name, figure in OWN.items()],
        "Computed in float64.",
    )
    counted = matters()
    text = [
        f"{sum(counted.values())} matters in {len(ERRATA)} entries, each with a figure that anyone can "
        "compute again: from what is published, and from what comes out or replaces it. Not every entry is "
        f"an error: {counted['form']} matters are forms that are good in their range. The units keep the "
        "published constants as named variants, so that their effect shows in the other sections.",
    ]
    return Section("errata", "Errata of the documents", text, [errata, figures], appendix=True)
