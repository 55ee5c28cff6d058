"""Claims of [C] on its cosine-quadratic models, each a square of a line in the cosine."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from blysk.bench.report.claims import Claim, ClaimTable, Document, Plot
from blysk.bench.report.section import Drawing
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.golden.reference.reflection import REFLECTION_MODELS

__all__ = [
    "EXPONENTS",
    "MODELS",
    "PUBLISHED",
    "ZONE",
    "claims",
    "coefficients",
    "curves",
    "errors",
    "section",
    "slopes",
    "tasks",
]

EXPONENTS = range(2, 1001)
"""Range of exponents in [C]."""

ZONE = 0.59363
"""Least brightness of Blinn's model in the "epicentre zone".

[C] does not define the zone. With this value the error of f2 is 7.924 %, as [C] states.
"""

MODELS = {"f2": "cosquad", "fQ (Q = 0.64)": "cosquad_q", "fQ2": "cosquad_lin"}
"""Models of [C], by their names in [C]."""

_RELATED = ("cosquad7", "coscos2", "coscos4")

_X = np.linspace(0, 30, 6001)
"""Values of ``n (1 - cos gamma)``.

The models depend on almost no other quantity. Above 30 Blinn's model is less than 1e-13.
"""


def errors(model: str) -> dict[str, Any]:
    """Largest errors of a model against Blinn's, over all angles and `EXPONENTS`.

    Returns
    -------
    dict
        ``absolute``; ``relative``: largest relative error in the zone; ``by_exponent``: exponent, absolute
        and relative error of some exponents.
    """
    found = []
    for exponent in EXPONENTS:
        cosine = np.append(1 - _X[exponent >= _X] / exponent, ZONE ** (1 / exponent))
        blinn = cosine**exponent
        error = np.abs(REFLECTION_MODELS[model].reflect(cosine, exponent) - blinn)
        # The zone includes its bound.
        zone = blinn >= ZONE * (1 - 1e-12)
        found.append((exponent, float(error.max()), float((error[zone] / blinn[zone]).max())))
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - EXPONENTS[0]
    return {
        "absolute": max(entry[1] for entry in found),
        "relative": max(entry[2] for entry in found),
        "by_exponent": [list(found[k]) for k in shown],
    }


def slopes() -> dict[str, float]:
    """Largest relative errors of lines in n for the slope k of fQ with Q = 0.64, over `EXPONENTS`.

    Returns
    -------
    dict
        ``line``: of [C]'s ``0.448 n + 0.099``; ``refitted``: of ``0.44813 n + 0.10235``.
    """
    exact, line, refitted = (
        np.array([REFLECTION_MODELS[model].slope(n) for n in EXPONENTS])
        for model in ("cosquad_q", "cosquad_lin", "cosquad_lin_refitted")
    )
    found = {"line": line, "refitted": refitted}
    return {name: float(np.abs(slope / exact - 1).max()) for name, slope in found.items()}


def coefficients() -> dict[str, float]:
    """Ideal coef(n) of fQ2, ``1/(2 pi integral_0^1 S(c) c dc)``, and [C]'s line for it.

    With the slope k, ``S = (1 - k (1-c))^2`` down to ``c = max(1 - 1/k, 0)``. The integral is taken in closed
    form.

    Returns
    -------
    dict
        Ideal values at n = 2, 3, 4, 5 and 10, with n as a text for the key. ``deviation`` is the largest
        relative error of the line over `EXPONENTS`, and ``deviation_exponent`` its exponent.
    """
    n = np.array(EXPONENTS, dtype=np.float64)
    k = np.array([REFLECTION_MODELS["cosquad_lin"].slope(value) for value in n])
    # With y = 1 - c from 0 to w: (1 - k y)^2 (1 - y).
    w = np.minimum(1 / k, 1)
    inside = w - (1 + 2 * k) * w**2 / 2 + (2 * k + k**2) * w**3 / 3 - k**2 * w**4 / 4
    ideal = 1 / (2 * np.pi * inside)
    line = np.array([REFLECTION_MODELS["cosquad_lin"].energy_factor(value) for value in n])
    deviation = np.abs(line / ideal - 1)
    return {
        **{str(value): float(ideal[value - EXPONENTS[0]]) for value in (2, 3, 4, 5, 10)},
        "deviation": float(deviation.max()),
        "deviation_exponent": int(n[deviation.argmax()]),
    }


def curves(exponent: int) -> dict[str, list[float]]:
    """Brightness against the angle, of Blinn's model and of the models of [C].

    Parameters
    ----------
    exponent : int
        Exponent n. Angles go up to the place where Blinn's model is about ``exp(-6)``, or to 90 degrees.

    Returns
    -------
    dict
        ``degrees``, and by model the brightness.
    """
    degrees = np.linspace(0, math.degrees(math.acos(max(1 - 6 / exponent, 0))), 121)
    cosine = np.cos(np.radians(degrees))
    models = ("blinn", *MODELS.values())
    brightness = {model: REFLECTION_MODELS[model].reflect(cosine, exponent).tolist() for model in models}
    return {"degrees": degrees.tolist(), **brightness}


def _of_model(name: str, key: str, printed: str = "") -> Claim:
    what = {"absolute": "largest absolute error", "relative": "largest relative error in the zone, %"}
    source = "[T]" if name in _RELATED else "[C]"
    settings = {"model": MODELS.get(name, name)}
    return Claim(source, "", f"{name}, {what[key]}", errors, settings, key, printed)


_LINE = "0.448 n + 0.099, largest relative error, %"

PUBLISHED = (
    _of_model("f2", "absolute", "0.162"),
    _of_model("f2", "relative", "7.924"),
    _of_model("fQ (Q = 0.64)", "relative", "1.255"),
    _of_model("fQ2", "relative", "1.256"),
    _of_model("fQ2", "absolute", "0.128"),
    Claim("[C]", "", _LINE, slopes, key="line", printed="0.5"),
    *(
        Claim("[C]", "", f"coef({n})", coefficients, key=n, printed=printed)
        for n, printed in (("2", "0.634"), ("3", "0.833"), ("4", "1.04"), ("5", "1.25"), ("10", "2.313"))
    ),
    Claim(
        "[C]",
        "",
        "largest deviation of the reflectance from 1",
        coefficients,
        key="deviation",
        printed="0.053",
    ),
)
"""Printed values of [C], in its order."""


def claims(quick: bool) -> list[Claim]:
    """`PUBLISHED`, and the same measures of related models and of a refitted line. Quick reports have all."""
    related = [_of_model(model, key) for model in _RELATED for key in ("absolute", "relative")]
    refitted = Claim(
        "ours", "", _LINE.replace("0.448 n + 0.099", "0.44813 n + 0.10235"), slopes, key="refitted"
    )
    return [*PUBLISHED, _of_model("fQ (Q = 0.64)", "absolute"), *related, refitted]


_SHOWN = (5, 20, 100)
"""Exponents of the drawn curves."""

_SEEN = 0.1
"""Least brightness of Blinn's model for a relative error to be drawn."""

_STYLES = {
    "blinn": {"color": "black", "linestyle": "-", "label": "Blinn"},
    "cosquad": {"color": "#d55e00", "linestyle": "-", "label": "f2"},
    "cosquad_q": {"color": "#0072b2", "linestyle": "--", "label": "fQ, Q = 0.64"},
    "cosquad_lin": {"color": "#009e73", "linestyle": ":", "label": "fQ2"},
}

_INFERRED = "We did not have the published figure. We infer its content from the text."


def _highlights(results: Sequence[dict]) -> Drawing:
    figure, row = panels(columns=len(_SHOWN))
    for exponent, found, panel in zip(_SHOWN, results, row, strict=True):
        for model, style in _STYLES.items():
            panel.plot(found["degrees"], found[model], **style)
        panel.set_title(f"n = {exponent}", fontsize=9)
        panel.set(xlabel="gamma, degrees", xlim=(0, found["degrees"][-1]))
    row[0].set_ylabel("brightness of the highlight")
    row[-1].legend(fontsize=8)
    title = "[C] figure 2: the models' highlights against the angle"
    return Drawing(
        "cosine-quadratic-2", title, svg(figure), f"The curves of fQ and fQ2 coincide. {_INFERRED}"
    )


def _errors(results: Sequence[dict]) -> Drawing:
    curve, *found = results
    figure, row = panels(columns=3)
    blinn = np.array(curve["blinn"])
    seen = blinn >= _SEEN
    for model, of in zip(MODELS.values(), found, strict=True):
        exponent, absolute, relative = np.transpose(of["by_exponent"])
        along = np.array(curve["degrees"])[seen], 100 * (np.array(curve[model])[seen] / blinn[seen] - 1)
        for panel, line in zip(row, (along, (exponent, 100 * relative), (exponent, absolute)), strict=True):
            panel.plot(*line, **_STYLES[model])
    row[0].set(xlabel="gamma, degrees", ylabel=f"relative error at n = {_SHOWN[1]}, %")
    titles = ("largest relative error in the zone, %", "largest absolute error")
    for panel, title in zip(row[1:], titles, strict=True):
        panel.set(xscale="log", xlabel="exponent n", ylabel=title)
        panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    row[-1].legend(fontsize=8)
    return Drawing(
        "cosine-quadratic-5",
        "[C] figure 5: errors against angle and exponent",
        svg(figure),
        f"Left: angles at which Blinn's model is at least {_SEEN}. Middle: angles at which it is at least "
        f"{ZONE}. Right: all angles. {_INFERRED}",
    )


_DOCUMENT = Document(
    "cosine-quadratic",
    "[C]: the cosine-quadratic model",
    [
        "[C] replaces `cos^n gamma` by the square of a line, `max(k (cos gamma - 1) + 1, 0)^2`. The model f2 "
        "has k = n/2. The k of fQ makes the model equal to Blinn's at the level Q = 0.64. The model fQ2 "
        "approximates the k of fQ by the line 0.448 n + 0.099.",
    ],
    [
        ClaimTable(
            "cosine-quadratic",
            "Errors of the models against Blinn's",
            claims,
            f"Float64, n from {EXPONENTS[0]} to {EXPONENTS[-1]}, all angles. An error of 1 is a full "
            "highlight. [C] does not define its zone. Here the zone has the angles at which Blinn's model "
            f"is at least {ZONE}. With this zone the error of f2 is 7.924 %.",
        )
    ],
    [
        Plot(lambda quick: [Task(curves, {"exponent": n}) for n in _SHOWN], _highlights),
        Plot(
            lambda quick: [
                Task(curves, {"exponent": _SHOWN[1]}),
                *(Task(errors, {"model": model}) for model in MODELS.values()),
            ],
            _errors,
        ),
    ],
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
