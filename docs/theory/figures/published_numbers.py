"""Numbers of errata.md and figures.md."""

import math
from collections.abc import Callable

from markdown import table

from blysk.bench.report import phong_blinn
from blysk.bench.report.claims import measured
from blysk.bench.report.cosine_quadratic import PUBLISHED, errors
from blysk.bench.report.counted import DEAR
from blysk.bench.report.errata import CLAIMS as ERRATA
from blysk.bench.report.errata import KINDS, factor_quadratics, matters
from blysk.bench.report.thesis import SPEEDS
from blysk.bench.report.thesis_software import counted
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax
from blysk.golden.reference.reflection import exponent_ratio


def _number(value: float) -> str:
    if value == 0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.4g}"
    return "under 1e-12" if abs(value) < 1e-12 else f"{value:.1e}"


def _errata(document: str) -> Callable[[], str]:
    def made() -> str:
        rows = []
        for claim in ERRATA:
            if claim.source.startswith(document):
                place = claim.source.removeprefix(document).lstrip(", ")
                numbers = (_number(float(value)) for value in claim.values(claim.task.run()))
                rows.append([place, claim.kind, claim.stated, claim.ours, claim.quantity, *numbers])
        head = ["place", "kind", "printed", "our correction or form", "quantity", "as printed"]
        return table([*head, "measured"], rows, 5)

    return made


def _cosine_quadratic() -> str:
    rows = []
    for claim, result in zip(PUBLISHED, measured(PUBLISHED), strict=True):
        printed, value = claim.values(result)
        digits = len(printed.partition(".")[2]) + 1
        same = "yes" if claim.verdict(result) else "no"
        rows.append([claim.quantity, printed, f"{value:.{digits}f}", same])
    return table(["figure", "printed", "computed", "to the digits printed"], rows)


def _line_models() -> str:
    rows = []
    for model in ("cosquad", "cosquad7", "cosquad_q", "cosquad_lin", "coscos2", "coscos4"):
        found = errors(model)
        rows.append([f"`{model}`", f"{found['absolute']:.4f}", f"{100 * found['relative']:.2f} %"])
    return table(["model", "largest absolute error", "largest relative error in the zone"], rows)


def _operations() -> str:
    """Operations of a normal or of a pixel's N·L and N·H, counted while the ways of [T] run."""
    rows = []
    for speed in SPEEDS:
        for rival in speed.baselines:
            for way in speed.ways:
                both = counted(way, 32), counted(rival, 32)
                dear = [sum(of.get(kind, 0.0) for kind in DEAR) for of in both]
                shown = (f"{sum(of.values()):.1f} ({cost:.1f})" for of, cost in zip(both, dear, strict=True))
                rows.append([speed.name, speed.printed, way, rival, *shown])
    return table(
        ["claim", "printed", "way", "compared with", "operations of the way", "of the other"], rows, 4
    )


def _phong_blinn() -> str:
    rows = []
    for local in (False, True):
        for way in phong_blinn.WAYS:
            found = phong_blinn.operations(way, local)
            fewer = f"{found['fewer']:.0%}" if found["fewer"] else ""
            rows.append(["each pixel's" if local else "the frame's", way, f"{found['all']:.1f}", fewer])
    return table(["L and V are", "way", "operations", "fewer than the first"], rows, 2)


def _phong_widths() -> str:
    columns = [(way, n) for way in ("along", "across") for n in (10, 100, 1000)]
    rows = [
        [
            f"{2 * degrees}",
            f"{4 * math.cos(math.radians(degrees)) ** 2:.3f}",
            *(f"{phong_blinn.exponent_of_width(way, degrees, n):.3f}" for way, n in columns),
        ]
        for degrees in (0, 15, 30, 45, 60, 75)
    ]
    return table(["L to V, degrees", "4 cos^2 a", *(f"{way}, n = {n}" for way, n in columns)], rows, 0)


def _errata_sentences() -> list[str]:
    ratio = float(exponent_ratio(math.cos(math.radians(40))))
    quadratics = factor_quadratics()
    plain = largest_error(half_angle_factor, minimax(half_angle_factor, 0, 1, 2), 0, 1)[1]
    counted = matters()
    kinds = [f"*{kind}*, {meaning} ({counted[kind]}" for kind, meaning in KINDS.items()]
    return [
        f"{sum(counted.values())} matters in {len(ERRATA)} entries",
        *kinds,
        f"{ratio:.2f} at 40°",
        f"relative error of a quadratic is {quadratics['relative'][1]:.3%}; with".replace("%", " %"),
        f"0.002 at most it is {quadratics['within'][1]:.3%}".replace("%", " %"),
        f"nodes has {quadratics['nodes'][1]:.3%}, and {quadratics['nodes'][0]:.4f}".replace("%", " %"),
        f"Our {plain:.3%} was".replace("%", " %"),
    ]


def _figure_sentences() -> list[str]:
    found = [errors(model) for model in ("cosquad", "cosquad_q", "cosquad_lin")]
    values = dict(zip(("f2", "fQ", "fQ2"), found, strict=True))
    ratios = {speed.name: speed.printed for speed in SPEEDS}
    return [
        f"f2 is off by {values['f2']['absolute']:.4f} at most, fQ2 by {values['fQ2']['absolute']:.4f}",
        *(f"{name}: {value} times" for name, value in ratios.items()),
    ]


TABLES: dict[str, Callable[[], str]] = {
    "errata-thesis": _errata("[T]"),
    "errata-cosine-quadratic": _errata("[C]"),
    "cosine-quadratic": _cosine_quadratic,
    "line-models": _line_models,
    "operations": _operations,
    "phong-blinn": _phong_blinn,
    "phong-widths": _phong_widths,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {
    "errata.md": _errata_sentences,
    "figures.md": _figure_sentences,
}
