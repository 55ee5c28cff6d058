"""The report's section on errata: the documents' statements, the right ones, and computed evidence."""

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
    factor_quadratic,
    flat_picture,
    four_times,
    held_root,
    highlight_loss,
    inverted_test,
    mirror,
    misprint,
    octaves,
    order,
    quadratic_length,
    recurrence,
    root_claim,
    root_digits,
    scaled_twice,
    second_lobe,
    shortcut,
    tangent,
    undefined_zone,
    worked_example,
    wrong_variable,
    zone_bounds,
)
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task

__all__ = [
    "ERRATA",
    "OWN",
    "Erratum",
    "Unmatched",
    "evidence",
    "section",
    "tasks",
]


@dataclass(frozen=True)
class Erratum:
    """A wrong statement of a document, its correction, and evidence.

    Parameters
    ----------
    place : str
        Document and place.
    published, right : str
        The published statement, and the right one.
    quantity : str
        Name of the computed quantity, with its unit.
    evidence : callable
        Computes the quantity twice: by the published and by the right statement.
    """

    place: str
    published: str
    right: str
    quantity: str
    evidence: Callable[[], Evidence]


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
        "74.547",
        "74.457",
        "error of the polynomial at x = 0.96, rad",
        misprint,
    ),
    "arccos-order": Erratum(
        "[T] table 3.1, columns A, B, C",
        "coefficients in descending order",
        "in ascending order: A + B x + C x^2",
        "largest error on [0, 0.5], rad",
        order,
    ),
    "arccos-claim": Erratum(
        "[T] table 3.1, error",
        "0.2 % at most",
        "more on [0.75, 0.96], by its own digits",
        "largest relative error on [0, 0.96]",
        arccos_claim,
    ),
    "arccos-one": Erratum(
        "[T] 3.3",
        "a quadratic on [0.96, 1]",
        "sqrt(1 - x) times a polynomial, or the half chord: arccos has a root's slope at 1",
        "largest error on [0.96, 1], corrected, rad",
        arccos_at_one,
    ),
    "root-1": Erratum(
        "[T] 2.1, degree 1",
        "0.64 - 0.07 z: 0.0005, 0.12 %",
        "the published digits are not that good",
        "largest error on [sqrt 2, 2]",
        lambda: root_claim(1, 0.0005),
    ),
    "root-2": Erratum(
        "[T] 2.1, degree 2",
        "0.014 z^2 - 0.119 z + 0.681: 2e-5, 0.004 %",
        "the published digits are not that good",
        "largest error on [sqrt 2, 2]",
        lambda: root_claim(2, 2e-5),
    ),
    "root-digits": Erratum(
        "[T] 2.1, degree 2",
        "coefficients of three digits",
        "0.68084977 - 0.1189218 z + 0.0142535 z^2",
        "largest error on [sqrt 2, 2]",
        root_digits,
    ),
    "factor-2": Erratum(
        "[T] 2.2, h of degree 2",
        "0.36 %",
        "no quadratic is that good",
        "largest relative error, r from 0 to 1",
        factor_quadratic,
    ),
    "factor-3": Erratum(
        "[T] 2.2, h of degree 3",
        "0.00038, 0.054 %",
        "the published digits are not that good",
        "largest error, r from 0 to 1",
        factor_claim,
    ),
    "flat-100": Erratum(
        "[T] 2.2, h fitted over all r",
        "least largest error",
        "exact at r = 1, where neighbouring normals are",
        "lost at a highlight's peak on a flat face, n = 100, LSB",
        lambda: highlight_loss(100),
    ),
    "flat-1000": Erratum(
        "[T] 2.2, h fitted over all r",
        "least largest error",
        "exact at r = 1, where neighbouring normals are",
        "lost at a highlight's peak on a flat face, n = 1000, LSB",
        lambda: highlight_loss(1000),
    ),
    "second-lobe": Erratum(
        "[T] figure 3.6",
        "the comparator is behind the square",
        "compare the base, before it is squared",
        "highlight at n = 20, gamma = 60 degrees",
        second_lobe,
    ),
    "shortcut-10": Erratum(
        "[T] 3.3",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 10 degrees",
        lambda: shortcut(10),
    ),
    "shortcut-60": Erratum(
        "[T] 3.3",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 60 degrees",
        lambda: shortcut(60),
    ),
    "recurrence-64": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 64 pixels, 10 degrees, 16 fraction bits",
        lambda: recurrence(64, 10, 16),
    ),
    "recurrence-256": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 256 pixels, 60 degrees, 16 fraction bits",
        lambda: recurrence(256, 60, 16),
    ),
    "recurrence-4095": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 4095 pixels, 60 degrees, 24 fraction bits",
        lambda: recurrence(4095, 60, 24),
    ),
    "tangent": Erratum(
        "[T] 3.2",
        "tan lambda as a quotient",
        "sums and differences of N_l·H and N_r·H over half-angle functions, and the angle of both",
        "share of spans of equal normals, the usual case, whose N·H comes out",
        tangent,
    ),
    "worked-example": Erratum(
        "[T] 4.1, worked example",
        "0.3445",
        "0.577^10 was taken for 0.003",
        "intensity",
        worked_example,
    ),
    "mnse": Erratum(
        "[T] 4.1, MNSE",
        "each error divided by its own pixel's distance from the mean",
        "sum of errors over sum of distances (NMSE)",
        "share of a flat picture's values with a defined figure",
        flat_picture,
    ),
    "inverted": Erratum(
        "[T] appendix В",
        "Phong where normals are close",
        "Gouraud where they are close",
        "share of the triangles of a teapot of 992 that the test of normals gives to Gouraud",
        inverted_test,
    ),
    "extrapolated": Erratum(
        "[T] appendix Г, NormalVector",
        "the end is extrapolated without the start vector",
        "N_l + g (N_r - N_l)",
        "error of the last normal, 10 degrees, 6 pixels",
        extrapolated_end,
    ),
    "scaled": Erratum(
        "[T] appendix Г, NormalVector",
        "dN.x is scaled twice, dN.z never",
        "each once",
        "error of the last normal's components, 10 degrees, 6 pixels",
        scaled_twice,
    ),
    "variable": Erratum(
        "[T] appendix Д",
        "P[1]*x in two channels",
        "P[1]*y",
        "error at a corner whose value is given, intensities 0.2, 0.4, 0.9",
        wrong_variable,
    ),
    "energy-phong": Erratum(
        "[C], Phong's normalising coefficient",
        "(n+2)/2n",
        "(n+2)/(2 pi)",
        "reflected energy at n = 10, to be 1",
        lambda: energy("phong", 10),
    ),
    "energy-blinn": Erratum(
        "[C], Blinn's normalising coefficient",
        "((n+2)(n+4))/(8n(2^(n/2)+n))",
        "((n+2)(n+4))/(8 pi (2^(-n/2)+n))",
        "reflected energy at n = 10, to be 1",
        lambda: energy("blinn", 10),
    ),
    "mirror": Erratum(
        "[C], mirror direction",
        "R = 2 (L x N) x N - L",
        "R = 2 (L·N) N - L: products are scalar",
        "length of R, to be 1",
        mirror,
    ),
    "zone": Erratum(
        "[C], epicentre zone",
        "7.924 %, of a zone that is not defined",
        f"where Blinn's model is at least {ZONE}",
        "largest relative error of f2 in the zone",
        undefined_zone,
    ),
    "four-times": Erratum(
        "[P], exponents of Blinn and Phong",
        "about 4 times",
        "4 at the peak alone, and more away from it",
        "n/p at gamma = 40 degrees",
        four_times,
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
        ("place", "published", "right", "computed", "as published", "as it should be"),
        [
            [erratum.place, erratum.published, erratum.right, erratum.quantity, *documents[name]]
            for name, erratum in ERRATA.items()
        ],
        "Both figures are computed by this report, but for those that a document claims itself (an error, "
        "an intensity, a ratio), which stand as published. Listings of [T] are as docs/theory/errata.md "
        "describes them.",
    )
    figures = Table(
        "errata-stated",
        "Figures stated for this project that do not come out",
        ("figure", "stated", "found", "first", "second"),
        [[figure.what, figure.stated, figure.found, *own[name]] for name, figure in OWN.items()],
        "Computed in float64.",
    )
    text = [
        f"{len(ERRATA)} entries on what the documents print, each with a figure that anyone can compute "
        "again: from what is published, and from what it should be. The units keep the published constants "
        "as named variants, so that their effect shows in the other sections.",
    ]
    return Section("errata", "Errata of the documents", text, [errata, figures], appendix=True)
