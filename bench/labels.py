"""Labels of points and lines of a drawing. They do not cover each other."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

__all__ = ["Label", "place_labels"]

_GAP = 5.0

_SPOTS = (
    *((1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (0, -1)),
    *((1, 2), (1, -2), (-1, 2), (-1, -2), (1, 3), (1, -3), (-1, 3), (-1, -3), (1, 4), (1, -4)),
    *((-1, 4), (-1, -4), (1, 5), (1, -5), (-1, 5), (-1, -5)),
)
"""Places of a label, nearest first, as numbers of steps to the side and up from its point."""


class Label(NamedTuple):
    """A text, and the point that the text names.

    Parameters
    ----------
    x, y : float
        The point, in data coordinates.
    text : str
        The text beside the point.
    color : str
        Colour of the text.
    weight : str
        ``"normal"`` or ``"bold"``.
    """

    x: float
    y: float
    text: str
    color: str = "#1c2126"
    weight: str = "normal"


def place_labels(
    axes: Axes, labels: Sequence[Label], points: Sequence[tuple[float, float]] = (), **options: Any
) -> int:
    """Write labels in their order. No label covers another label or a point.

    A label at a distance from its point gets a thin line to the point. A label without a free place is left
    out.

    Parameters
    ----------
    axes : Axes
        The axes. Their limits and scales must not change afterwards.
    labels : sequence of Label
        The labels, the more important first.
    points : sequence of (x, y)
        Points of the data that labels must not cover.
    **options
        Options of the text.

    Returns
    -------
    int
        Number of labels left out.
    """
    canvas = FigureCanvasAgg(axes.figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    to_pixels = axes.transData.transform
    frame = axes.get_window_extent(renderer)
    taken = [(x - 4, y - 4, x + 4, y + 4) for x, y in to_pixels(np.reshape([*points], (-1, 2)))]
    left_out = 0
    for label in labels:
        x, y = to_pixels((label.x, label.y))
        text = axes.text(0, 0, label.text, fontsize=7, color=label.color, fontweight=label.weight, **options)
        box = text.get_window_extent(renderer)
        for side, up in _SPOTS:
            left = x + side * _GAP if side > 0 else x + side * _GAP - box.width if side else x - box.width / 2
            low = y - box.height / 2 + up * (box.height * 0.8 + _GAP / 2)
            spot = left, low, left + box.width, low + box.height
            inside = frame.x0 < spot[0] and spot[2] < frame.x1 and frame.y0 < spot[1] and spot[3] < frame.y1
            if inside and not any(_overlap(spot, other) for other in taken):
                break
        else:
            text.remove()
            left_out += 1
            continue
        text.set(position=axes.transData.inverted().transform((left, low)), va="bottom", ha="left")
        taken.append(spot)
        if abs(up) > 1:
            near = left if side > 0 else left + box.width
            end = axes.transData.inverted().transform((near, low + box.height / 2))
            axes.plot(
                [label.x, end[0]], [label.y, end[1]], color=label.color, linewidth=0.5, alpha=0.7, zorder=1
            )
    return left_out


def _overlap(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
