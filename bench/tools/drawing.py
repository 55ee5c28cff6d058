"""Drawing of a structure: boxes in columns from left to right, and arrows between the boxes.

A wide drawing is folded: its columns are in several bands, each below the band before. An arrow from band to
band ends at a tag, and continues at a tag of the same number.
"""

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import count, pairwise

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path

from blysk.bench.tools.graph import Graph, Node, layers

__all__ = ["draw_structure"]

_FONT = 8.0
_LINE = 10.5
_GAP = 9.0
_WIDEST = 860.0
"""Width above which a drawing is folded."""
_BETWEEN = 30.0
"""Approximate width between columns."""
_FORMULAS, _LONGEST, _SHORT = 4, 40, 20
"""Largest number of formulas in a box, and of characters of a formula in a box and in a tag.

A name replaces a longer formula.
"""
_TAGS = 70.0
"""Approximate width that tags take on a side of a band."""
_BAND = 6
"""A further band costs as much as this number of arrows from band to band."""
_FACES = {
    "input": "#ffffff",
    "output": "#ffffff",
    "register": "#eef1f4",
    "operation": "#ffffff",
    "memory": "#dcefdc",
    "unit": "#d9e6f7",
    "tag": "#ffffff",
}
_MULTIPLIER, _ADDER = "#f9d9b8", "#fbf3cf"
_INKS = ("#35506b", "#7a4a12", "#2f6b3a", "#6a3470", "#8a2f3c", "#22696c", "#5a5a1e", "#444444")
_BACK = "#c0392b"


@dataclass
class _Place:
    """A box in a column, or a point in a column through which an arrow passes."""

    column: int
    width: float
    height: float
    node: Node | None = None
    x: float = 0.0
    y: float = 0.0


@dataclass
class _Band:
    """Boxes of some columns, and the tags of arrows from and to other columns.

    Parameters
    ----------
    graph : Graph
        Boxes and tags.
    columns : dict of int to int
        Column of each box and tag, from 0 on.
    back : set of (int, int)
        Arrows that lead back.
    sources : dict of int to int
        For each tag the box in the whole graph from which its arrow comes.
    """

    graph: Graph
    columns: dict[int, int]
    back: set[tuple[int, int]]
    sources: dict[int, int] = field(default_factory=dict)


def _shown(operations: Counter[str]) -> Counter[str]:
    """Operations as a box shows them.

    Constants are marked only at products, because a product by a constant needs no multiplier.
    """
    shown: Counter[str] = Counter()
    for symbol, number in operations.items():
        shown["× const" if symbol == "×c" else symbol.removesuffix("c")] += number
    return shown


def _called(node: Node) -> str:
    """Text of a tag for a box: its only formula, or its name."""
    return node.formulas[0] if len(node.formulas) == 1 and len(node.formulas[0]) <= _SHORT else node.name


def _lines(node: Node) -> list[tuple[str, str]]:
    """Style and text of the lines in a box."""
    lines = []
    if node.operations:
        parts = [
            f"{count} {symbol}" if count > 1 else symbol
            for symbol, count in sorted(_shown(node.operations).items())
            if count
        ]
        lines.append(("operation", "  ".join(parts)))
    shown = [text for text in node.formulas if len(text) <= _LONGEST]
    lines += [("name", text) for text in shown[:_FORMULAS]]
    if len(node.formulas) > len(shown[:_FORMULAS]) > 0:
        lines.append(("detail", f"and {len(node.formulas) - len(shown[:_FORMULAS])} more"))
    if node.name and node.name not in shown:
        lines.append(("detail" if shown else "name", node.name))
    detail = node.detail
    if node.kind == "register":
        detail = f"{detail} bit{'s' * (detail != '1')}"
    if node.copies > 1:
        detail = f"{node.copies} × {detail}" if detail else f"{node.copies} ×"
    if node.stages > 1:
        detail = f"{detail}, {node.stages} cycles"
    if detail:
        lines.append(("detail", detail))
    return lines


def _size(node: Node) -> tuple[float, float]:
    """Width and height of a box."""
    texts = _lines(node)
    width = max(len(text) * (0.64 if style == "name" else 0.58) for style, text in texts) * _FONT + 11
    return width, len(texts) * _LINE + 6


def _spread(wanted: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Places of the boxes of a column, in their order, as near as possible to wanted places.

    The boxes do not overlap.
    """
    steps = np.r_[0.0, np.cumsum((heights[:-1] + heights[1:]) / 2 + _GAP)]
    blocks: list[list[float]] = []
    for value in wanted - steps:
        blocks.append([value, 1.0])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            value, count = blocks.pop()
            before, more = blocks.pop()
            blocks.append([(before * more + value * count) / (more + count), more + count])
    return np.repeat([b[0] for b in blocks], [int(b[1]) for b in blocks]) + steps


class _Layout:
    """Places of boxes, and of the points through which arrows pass."""

    def __init__(self, band: _Band):
        graph, columns, back = band.graph, band.columns, band.back
        self.places: list[_Place] = []
        self.paths: list[tuple[list[int], bool, bool]] = []
        self.links: dict[int, list[int]] = defaultdict(list)
        index = {}
        for number, node in graph.nodes.items():
            index[number] = self._add(columns[number], *_size(node), node)
        self.inks = {k: _INKS[band.sources.get(n, n) % len(_INKS)] for n, k in index.items()}
        trunks: dict[tuple[int, int], int] = {}
        for (a, b), is_data in sorted(graph.edges.items()):
            if (a, b) in back:
                if a == b:
                    path = [index[a], index[a]]
                else:
                    points = range(columns[a], columns[b] - 1, -1)
                    path = [index[a], *(self._add(k, 0, 2) for k in points), index[b]]
            else:
                path = [index[a]]
                for k in range(columns[a] + 1, columns[b]):
                    if (a, k) not in trunks:
                        trunks[a, k] = self._add(k, 0, 2)
                    path.append(trunks[a, k])
                path.append(index[b])
            self.paths.append((path, is_data, (a, b) in back))
            for p, q in pairwise(path):
                if q not in self.links[p] and p != q:
                    self.links[p].append(q)
                    self.links[q].append(p)
        self.columns: list[list[int]] = [[] for _ in range(max(columns.values()) + 1)]
        for k, place in enumerate(self.places):
            self.columns[place.column].append(k)
        self._order()
        self._set_heights()
        self._close_gaps()
        self._set_columns()

    def _add(self, column, width, height, node=None) -> int:
        self.places.append(_Place(column, width, height, node))
        return len(self.places) - 1

    def _beside(self, k: int, column: int) -> list[int]:
        return [other for other in self.links[k] if self.places[other].column == column]

    def _crossings(self) -> int:
        count = 0
        for column, order in enumerate(self.columns[:-1]):
            following = {k: place for place, k in enumerate(self.columns[column + 1])}
            ends = [sorted(following[o] for o in self._beside(k, column + 1)) for k in order]
            ends = np.array([e for group in ends for e in group])
            count += int(np.triu(ends[:, None] > ends[None, :], 1).sum())
        return count

    def _order(self) -> None:
        """Order each column by its neighbours' mean places. The order with the fewest crossings is taken."""
        best, fewest = [list(c) for c in self.columns], self._crossings()
        last = len(self.columns) - 1
        for sweep in range(40):
            forwards = sweep % 2 == 0
            for column in range(1, last + 1) if forwards else range(last - 1, -1, -1):
                beside = column - 1 if forwards else column + 1
                position = {k: place for place, k in enumerate(self.columns[beside])}
                order = self.columns[column]
                means = {}
                for place, k in enumerate(order):
                    near = [position[o] for o in self._beside(k, beside)]
                    # A box without a neighbour keeps its relative place in the column.
                    own = place / max(len(order) - 1, 1) * max(len(position) - 1, 0)
                    means[k] = float(np.mean(near)) if near else own
                order.sort(key=means.__getitem__)
            crossings = self._crossings()
            if crossings < fewest:
                best, fewest = [list(c) for c in self.columns], crossings
        self.columns = best

    def _set_heights(self) -> None:
        heights = [np.array([self.places[k].height for k in order]) for order in self.columns]
        for order, high in zip(self.columns, heights, strict=True):
            middle = _spread(np.zeros(len(order)), high)
            for k, y in zip(order, middle - middle.mean(), strict=True):
                self.places[k].y = y
        for sweep in range(60):
            run = range(len(self.columns)) if sweep % 2 == 0 else range(len(self.columns) - 1, -1, -1)
            for column in run:
                order = self.columns[column]
                wanted = []
                for k in order:
                    near = [self.places[o].y for o in self.links[k]]
                    wanted.append(np.mean(near) if near else self.places[k].y)
                for k, y in zip(order, _spread(np.array(wanted), heights[column]), strict=True):
                    self.places[k].y = float(y)

    def _close_gaps(self) -> None:
        """Take out empty horizontal stripes, for example between parts that no arrow joins."""
        shift, bottom = 0.0, -np.inf
        for place in sorted(self.places, key=lambda p: p.y - p.height / 2):
            top = place.y - place.height / 2
            if np.isfinite(bottom):
                shift += max(0.0, top - bottom - _GAP)
            bottom = max(bottom, place.y + place.height / 2)
            place.y -= shift

    @property
    def width(self) -> float:
        """Distance from the leftmost side of a box to the rightmost side."""
        return max(p.x + p.width / 2 for p in self.places) - min(p.x - p.width / 2 for p in self.places)

    def _set_columns(self) -> None:
        x = 0.0
        for column, order in enumerate(self.columns):
            width = max(self.places[k].width for k in order)
            for k in order:
                self.places[k].x = x + width / 2
            lines = sum(len(self._beside(k, column + 1)) for k in order)
            x += width + 16 + min(lines, 22)


def _cuts(graph: Graph, columns: dict[int, int]) -> list[int]:
    """First columns of the bands. Each band is narrow enough, and few arrows lead from band to band."""
    last = max(columns.values()) + 1
    widths = np.zeros(last)
    for number, column in columns.items():
        widths[column] = max(widths[column], _size(graph.nodes[number])[0])
    widths += _BETWEEN
    cut = [
        len({a for a, b in graph.edges if min(columns[a], columns[b]) < k <= max(columns[a], columns[b])})
        for k in range(last)
    ]
    best: list[tuple[float, list[int]]] = [(0.0, [])]
    for end in range(1, last + 1):
        found = []
        for start in range(end):
            width = widths[start:end].sum() + _TAGS * ((start > 0) + (end < last))
            # A column that is too wide is a band of its own.
            if width <= _WIDEST or start == end - 1:
                cost, starts = best[start]
                found.append((cost + (cut[start] + _BAND) * (start > 0), [*starts, start]))
        best.append(min(found))
    return best[last][1]


def _bands(graph: Graph) -> list[_Band]:
    """The boxes of a graph in one band, or in several bands if one band would be too wide."""
    columns, back = layers(graph)
    whole = _Band(graph, columns, back)
    starts = _cuts(graph, columns)
    if len(starts) == 1 or _Layout(whole).width <= _WIDEST:
        return [whole]
    band_of = {
        number: int(np.searchsorted(starts, column, "right")) - 1 for number, column in columns.items()
    }
    bands = [_Band(Graph(), {}, set()) for _ in starts]
    for number, node in graph.nodes.items():
        bands[band_of[number]].graph.nodes[number] = node
        bands[band_of[number]].columns[number] = columns[number]
    fresh = count(max(graph.nodes) + 1)
    tags: dict[int, str] = {}
    known: dict[tuple[int, int, bool], int] = {}

    def tag(source: int, band: int, leaves: bool, column: int) -> int:
        key = source, band, leaves
        if key not in known:
            known[key] = number = next(fresh)
            node = graph.nodes[source]
            text = tags.setdefault(source, f"{len(tags) + 1} {_called(node)}".strip())
            bands[band].graph.nodes[number] = Node("tag", text)
            bands[band].columns[number] = column
            bands[band].sources[number] = source
        number = known[key]
        bands[band].columns[number] = min(bands[band].columns[number], column)
        return number

    for (a, b), is_data in sorted(graph.edges.items()):
        near, far = band_of[a], band_of[b]
        if near == far:
            bands[near].graph.edges[a, b] = is_data
            bands[near].back |= {(a, b)} & back
        else:
            bands[near].graph.connect(a, tag(a, near, True, columns[a] + 1), is_data)
            bands[far].graph.connect(tag(a, far, False, columns[b] - 1), b, is_data)
    for band in bands:
        ranks = {column: k for k, column in enumerate(sorted(set(band.columns.values())))}
        band.columns = {number: ranks[column] for number, column in band.columns.items()}
    return bands


def draw_structure(graph: Graph) -> Figure:
    """Draw boxes in columns from left to right, and the arrows between them.

    Parameters
    ----------
    graph : Graph
        Structure, made by `graph_of`.

    Returns
    -------
    Figure
        A matplotlib figure of the drawing's size, 72 units to the inch.
    """
    layouts = [_Layout(band) for band in _bands(graph)]
    right, bottom = 0.0, 0.0
    limits = []
    for layout in layouts:
        left = min(p.x - p.width / 2 for p in layout.places) - 14
        top = min(p.y - p.height / 2 for p in layout.places) - 18
        for place in layout.places:
            place.x -= left
            place.y += bottom - top
        right = max(right, *(p.x + p.width / 2 + 14 for p in layout.places))
        bottom = max(p.y + p.height / 2 for p in layout.places) + 10
        limits.append(bottom)
    figure = Figure(figsize=(right / 72, bottom / 72), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(0, right)
    axes.set_ylim(bottom, 0)
    for y in limits[:-1]:
        axes.plot([0, right], [y, y], color="#bbbbbb", linewidth=0.7, linestyle=(0, (1, 3)), zorder=0)
    for layout in layouts:
        _draw_arrows(axes, layout)
        for place in layout.places:
            if place.node:
                _draw_box(axes, place)
    return figure


def _draw_arrows(axes, layout: _Layout) -> None:
    column_left = {p.column: p.x - p.width / 2 for p in layout.places}
    column_right = {p.column: p.x + p.width / 2 for p in layout.places}
    for p in layout.places:
        column_left[p.column] = min(column_left[p.column], p.x - p.width / 2)
        column_right[p.column] = max(column_right[p.column], p.x + p.width / 2)

    incoming: dict[int, list[int]] = defaultdict(list)
    for number, (path, _, _) in enumerate(layout.paths):
        incoming[path[-1]].append(number)
    entry = {}
    for k, numbers in incoming.items():
        place = layout.places[k]
        numbers.sort(key=lambda n: (layout.places[layout.paths[n][0][-2]].y, n))
        spread = np.linspace(-0.32, 0.32, len(numbers)) if len(numbers) > 1 else [0.0]
        entry |= {n: place.y + s * place.height for n, s in zip(numbers, spread, strict=True)}

    for number, (path, is_data, is_back) in enumerate(layout.paths):
        a, b = layout.places[path[0]], layout.places[path[-1]]
        ink = _BACK if is_back else layout.inks[path[0]]
        x0, y0, x1, y1 = a.x + a.width / 2, a.y, b.x - b.width / 2 - 4, entry[number]
        vertices, codes = [(x0, y0)], [Path.MOVETO]

        def curve(*points, vertices=vertices, codes=codes):
            vertices.extend(points)
            codes.extend([Path.CURVE4] * len(points))

        if path[0] == path[-1]:
            high = a.y - a.height / 2 - 8
            curve((x0 + 12, y0), (x0 + 12, high), (a.x, high))
            curve((x1 - 10, high), (x1 - 10, y1), (x1, y1))
        else:
            # Within a column an arrow keeps its height, so it does not cross boxes of this column.
            x, y = column_right[a.column], y0
            vertices.append((x, y))
            codes.append(Path.LINETO)
            for k in path[1:-1]:
                p = layout.places[k]
                edges = (column_left[p.column], column_right[p.column])
                near, far = reversed(edges) if is_back else edges
                bend = (near - x) / 2
                if is_back and k == path[1]:
                    vertices.append((near, y))
                    codes.append(Path.LINETO)
                    curve((near + 12, y), (near + 12, p.y), (near, p.y))
                else:
                    curve((x + bend, y), (near - bend, p.y), (near, p.y))
                vertices.append((far, p.y))
                codes.append(Path.LINETO)
                x, y = far, p.y
            if is_back:
                curve((x - 14, y), (x - 14, y1), (x, y1))
                vertices.append((x1, y1))
                codes.append(Path.LINETO)
            else:
                near = column_left[b.column] - 4
                curve((x + (near - x) / 2, y), (near - (near - x) / 2, y1), (near, y1))
                vertices.append((x1, y1))
                codes.append(Path.LINETO)
        axes.add_patch(
            PathPatch(
                Path(vertices, codes),
                fill=False,
                edgecolor=ink,
                linewidth=0.9,
                linestyle="-" if is_data else (0, (2.5, 2)),
                zorder=1,
            )
        )
        axes.fill([x1, x1, x1 + 4], [y1 - 2, y1 + 2, y1], color=ink, linewidth=0, zorder=1)


def _draw_box(axes, place: _Place) -> None:
    node = place.node
    face = _FACES[node.kind]
    if node.operations["×"]:
        face = _MULTIPLIER
    elif any(node.operations[symbol] for symbol in ("×c", "+", "+c", "−", "−c")):
        face = _ADDER
    rounded = node.kind in ("input", "output", "operation", "tag")
    x, y = place.x - place.width / 2, place.y - place.height / 2
    style = f"round,pad=0,rounding_size={min(place.height / 2.2, 9) if rounded else 0.1}"
    box = FancyBboxPatch(
        (x, y),
        place.width,
        place.height,
        boxstyle=style,
        facecolor=face,
        edgecolor="#999999" if node.kind == "tag" else "#333333",
        linewidth=0.9,
    )
    axes.add_patch(box)
    if node.kind == "register":
        # The clock's mark.
        low = y + place.height
        axes.plot([x, x + 4, x], [low - 7, low - 4, low - 1], color="#333333", linewidth=0.7, zorder=3)
    for k, (style, text) in enumerate(_lines(node)):
        axes.text(
            place.x,
            y + 3 + (k + 0.5) * _LINE,
            text,
            ha="center",
            va="center",
            fontsize=_FONT + (style == "operation"),
            fontweight="bold" if style == "name" and node.kind != "tag" else "normal",
            color="#555555" if style == "detail" else "black",
            zorder=3,
        )
