"""Conclusion of stiff and extreme cases: each method's worst error in its range, and the range's end."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from blysk.bench.colors import style_of
from blysk.bench.report.section import Conclusion, Drawing
from blysk.bench.report.stability_errors import GOOD, RANGE_EXPONENTS
from blysk.bench.svg import panels, svg

__all__ = ["TERMINATOR", "conclusion"]

TERMINATOR = "5"
"""Group of the cases in which N.L changes its sign."""


def _cases(groups: Mapping[str, Sequence[dict]]) -> Iterator[dict]:
    for found in groups.values():
        yield from found


def _worst(groups: Mapping[str, Sequence[dict]]) -> tuple[float, str, str]:
    """Largest error inside the range in spans without a flag, with its case and its grade.

    These are spans after cuts, and given spans that the method serves whole.
    """
    errors = [
        *(
            (of["prepared"]["silent"], of["case"], of["prepared"]["grade"])
            for of in _cases(groups)
            if of["prepared"]
        ),
        *(
            (of["given"]["safe"], of["case"], of["given"]["safe_grade"])
            for of in _cases(groups)
            if of["inside"]
        ),
    ]
    return max(errors, default=(0.0, "", ""))


def _lit(groups: Mapping[str, Sequence[dict]]) -> Mapping[str, Sequence[dict]]:
    """Groups without `TERMINATOR`, in which a bright highlight may end within a pixel."""
    return {group: found for group, found in groups.items() if group != TERMINATOR}


def _outside(groups: Mapping[str, Sequence[dict]]) -> float:
    """Largest error in spans without a flag, inside or outside the range."""
    return max((of["given"]["silent"] for of in _cases(groups)), default=0.0)


def conclusion(cases: Mapping[str, Any], ranges: Mapping[str, Any]) -> Conclusion:
    """Conclusion: worst case inside the range, and the end of the range, of every method.

    Parameters
    ----------
    cases, ranges : mapping
        Results of `measure` and `measure_ranges` by method.
    """
    worst = {method: _worst(groups) for method, groups in cases.items()}
    lit = {method: _worst(_lit(groups)) for method, groups in cases.items()}
    silent = [
        method
        for method, groups in cases.items()
        if any(of["prepared"] and of["prepared"]["grade"] == "bad" for of in _cases(groups))
        or any(of["inside"] and of["given"]["safe_grade"] == "bad" for of in _cases(groups))
    ]
    within, elsewhere = (
        sorted((method for method in of if of[method][0] <= GOOD), key=lambda method: of[method][0])
        for of in (worst, lit)
    )
    elsewhere = [method for method in elsewhere if method not in within]
    count = sum(1 for _ in _cases(next(iter(cases.values()))))
    least, most = (of(worst, key=lambda method: worst[method][0]) for of in (min, max))
    which = "no method is" if not silent else f"{_listed(silent)} {'is' if len(silent) == 1 else 'are'}"
    sentence = f"Inside its range {which} silently wrong in {count} stiff and extreme cases. "
    if within:
        said = ", ".join(f"**`{method}`** ({worst[method][0]:.2f})" for method in within)
        sentence += f"These methods stay within {GOOD:g} LSB in all cases: {said}"
    else:
        sentence += (
            f"No method stays within {GOOD:g} LSB in all cases. `{least}` has the smallest largest error, "
            f"{worst[least][0]:.2f} LSB"
        )
    if elsewhere:
        said = ", ".join(f"`{method}` ({lit[method][0]:.2f})" for method in elsewhere)
        sentence += f". These methods do so in all cases without a terminator: {said}"
    error, case, grade = worst[most]
    sentence += f". The largest error inside a range is {_figure(error)} LSB (`{most}`, {case})."
    sentence += _STATED.get(grade, "")
    if "quotient" in ranges:
        end = min(ranges["quotient"]["widest"][str(exponent)] for exponent in RANGE_EXPONENTS)
        sentence += (
            f" `quotient` serves spans of up to {end:.3g} degrees at every exponent, if the lengths of the "
            "vectors at their ends have a ratio of at most 2. Other spans are halved before the pipeline."
        )
    return Conclusion("In which range is a method exact?", sentence, _drawing(cases, ranges, worst, lit))


_STATED = {
    "fair": " The documentation of this method states an error of this size.",
    "bad": " The documentation of this method states no error of this size.",
}
"""What the documentation says about the largest error, by the grade of its case (`measure_case`)."""


def _figure(error: float) -> str:
    return f"{error:.0f}" if error >= 9.95 else f"{error:.2g}"


def _listed(methods: Sequence[str]) -> str:
    return ", ".join(f"`{method}`" for method in methods)


def _drawing(
    cases: Mapping[str, Any], ranges: Mapping[str, Any], worst: Mapping[str, tuple], lit: Mapping[str, tuple]
) -> Drawing:
    methods = sorted(cases, key=lambda method: (-worst[method][0], -lit[method][0]))
    figure, (left, right) = panels(9.2, 0.3 * len(methods) + 1.3, 2)
    place = np.arange(len(methods))
    for y, method in zip(place, methods, strict=True):
        style, error, outside = style_of(method), worst[method][0], _outside(cases[method])
        left.plot([error, max(outside, error)], [y, y], color=style.color, linewidth=0.8, linestyle=":")
        left.plot(outside, y, marker="o", markersize=5, markerfacecolor="white", color=style.color)
        left.plot(error, y, marker="|", markersize=8, color=style.color)
        left.plot(lit[method][0], y, marker=style.marker, markersize=6, color=style.color)
        for value in {error, lit[method][0] if lit[method][0] < error / 1.4 else error}:
            left.text(
                value, y - 0.42, _figure(value), fontsize=6.5, ha="center", va="center", color=style.color
            )
        widest = (
            [ranges[method]["widest"][str(exponent)] for exponent in RANGE_EXPONENTS]
            if method in ranges
            else []
        )
        if widest:
            right.plot(widest, [y] * len(widest), color=style.color, linewidth=1, marker="|", markersize=7)
            ends = (widest[0], RANGE_EXPONENTS[0]), (widest[-1], RANGE_EXPONENTS[-1])
            same = max(widest) < 1.05 * min(widest)
            for angle, exponent in ends[:1] if same else ends:
                text = f"{angle:.3g}°, any n" if same else f"{angle:.3g}°, n = {exponent}"
                right.text(angle, y - 0.42, text, fontsize=6.5, ha="center", va="center", color=style.color)
    left.axvline(GOOD, color="#59626c", linewidth=0.8, linestyle="--")
    left.set(xscale="log", xlabel="largest error, LSB of linear light")
    left.set_title("worst case", fontsize=9, loc="left")
    right.set(xscale="log", xlabel="widest span that is served whole, degrees")
    right.set_title("end of the range", fontsize=9, loc="left")
    for panel, ticks in ((left, (0.5, 1, 2, 5, 10, 50, 200)), (right, (0.5, 1, 2, 5, 10, 20, 45, 90, 180))):
        panel.margins(x=0.12)
        low, high = panel.get_xlim()
        kept = [tick for tick in ticks if low <= tick <= high]
        panel.set_xticks(kept, [f"{tick:g}" for tick in kept], minor=False)
        panel.set_xticks((), minor=True)
        panel.set(yticks=place, ylim=(-0.9, len(methods) - 0.4))
    left.set_yticklabels(methods)
    right.set_yticklabels([""] * len(methods))
    note = (
        "Left: largest errors of each method. A filled mark is the worst case inside the range, without the "
        "cases of the terminator. In these cases a bright highlight of a small exponent ends within a pixel. "
        "A bar is the worst case of all cases inside the range. An open mark is the worst uncut span "
        f"without a flag, also outside the range. The dashed line is {GOOD:g} LSB. Right: the widest span, "
        "from the smallest exponent to the largest."
    )
    return Drawing(
        "stability-worst", "Worst case of each method, and the end of its range", svg(figure), note
    )
