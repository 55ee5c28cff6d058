"""Styles of methods: a colour, a marker and a dash of each, the same in every drawing and on every page.

The colours are from Okabe and Ito. Readers with any colour vision can tell them apart. Yellow is left out,
because it is too light on white. A variant of a method has the method's colour, but other dashes and another
marker.
"""

from typing import NamedTuple

from blysk.golden.presets import PUBLISHED

__all__ = ["STYLES", "Style", "style_of"]


class Style(NamedTuple):
    """Style of a method's lines and points.

    Parameters
    ----------
    color, dark : str
        ``#rrggbb`` on light and on dark paper.
    dash : str
        Dashes of a line, as matplotlib takes them.
    marker : str
        Marker of a point, as matplotlib takes it.
    """

    color: str
    dark: str
    dash: str = "-"
    marker: str = "o"


STYLES = {
    "linear": Style("#6e6e6e", "#a8a8a8", marker="^"),
    "renormalise": Style("#1a1a1a", "#f0f0f0", marker="s"),
    "bisection": Style("#b87a00", "#e69f00", marker="v"),
    "quadratic": Style("#0072b2", "#4fb3ea", marker="o"),
    "quadratic-eval": Style("#0072b2", "#4fb3ea", "--", "h"),
    "quadratic-horner": Style("#0072b2", "#4fb3ea", ":", "8"),
    "angular": Style("#00805c", "#23c397", marker="P"),
    "recurrence": Style("#3b95c4", "#8fd0f5", "--", "X"),
    "chord-local": Style("#b0508a", "#e08fc0", marker="D"),
    "quotient": Style("#d55e00", "#ff8b3d", marker="*"),
}
"""Style of each method."""


def style_of(method: str) -> Style:
    """Style of a method. A variant as published has the style of its method."""
    if method in STYLES:
        return STYLES[method]
    base = method.rpartition("-")[0] if method in PUBLISHED else ""
    return STYLES.get(base, Style("#000000", "#ffffff", "-."))
