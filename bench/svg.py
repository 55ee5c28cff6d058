"""Figures of matplotlib as small SVG texts that are equal in every run."""

import re
from collections import Counter
from io import StringIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

__all__ = [
    "STYLE",
    "panels",
    "svg",
]


STYLE = {"svg.fonttype": "none", "svg.hashsalt": "blysk", "font.family": ["DejaVu Sans"], "font.size": 8}


# Pictures.


def _with_classes(text: str) -> str:
    """The SVG. Styles that occur more than once become classes."""
    found = Counter(re.findall(r' style="([^"]*)"', text))
    names = {style: f"s{k}" for k, (style, uses) in enumerate(found.items()) if uses > 1}
    rules = "".join(f".{name}{{{style}}}\n" for style, name in names.items())
    text = re.sub(r' style="([^"]*)"', lambda m: f' class="{names[m[1]]}"' if m[1] in names else m[0], text)
    return text.replace("</style>", f"\n{rules}</style>", 1)


_NUMBER = re.compile(r"(?<![\w#.])-?\d+\.\d{2,}(?![\w.])")


def _rounded(number: re.Match) -> str:
    return f"{float(number[0]):.1f}".rstrip("0").rstrip(".")


def svg(figure: Figure) -> str:
    """A figure as SVG, equal in every run: without date, indentation, clipping and needless digits."""
    buffer = StringIO()
    with rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, facecolor="white")
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    text = re.sub(r"<!DOCTYPE.*?>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' clip-path="url\([^"]*"', "", text)
    text = re.sub(r"<clipPath.*?</clipPath>", "", text, flags=re.DOTALL)
    # Numbers of strokes and positions are rounded. Numbers in texts stay.
    text = re.sub(r"<[^>]*>", lambda tag: _NUMBER.sub(_rounded, tag[0]), text)
    text = re.sub(r'"([\d.]+)pt"', lambda m: f'"{float(m[1]) * 4 / 3:.0f}"', text)
    text = _with_classes(text)
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([\w-]+)"', lambda m: m[0] if m[1] in used else "", text)
    text = re.sub(r"font-family: 'DejaVu Sans'", "font-family: 'DejaVu Sans', Verdana, sans-serif", text)
    return re.sub(r"\s*\n\s*", "\n", text).strip() + "\n"


def panels(
    width: float = 9.0, height: float = 3.0, columns: int = 1, **options: Any
) -> tuple[Figure, np.ndarray]:
    """An empty drawing of some panels in a row, with a light grid and small letters.

    Parameters
    ----------
    width, height : float
        Inches.
    columns : int
        Number of panels.
    **options
        Options of `matplotlib.figure.Figure.subplots`.
    """
    style = {"font.size": 8, "axes.axisbelow": True, "axes.grid": True}
    with rc_context(style | {"grid.color": "#dddddd", "grid.linewidth": 0.5}):
        figure = Figure(figsize=(width, height), layout="constrained")
        return figure, figure.subplots(1, columns, squeeze=False, **options)[0]
