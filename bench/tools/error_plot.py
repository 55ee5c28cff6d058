"""Drawings of the errors of a unit's variants, against the operand of the unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from blysk.bench.tools.blocks import Entry
from blysk.bench.units.record import Record
from blysk.bench.units.sample import Decisions, Sample

__all__ = [
    "draw_errors",
]


_DEPTH = 1e-7
"""Errors smaller than this share of the largest error are not drawn."""

_PUBLISHED = "total, as published"


def _envelope(at: np.ndarray, errors: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Largest error in each interval. NaN in an interval without operands."""
    place = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    largest = np.full(len(edges) - 1, -1.0)
    np.maximum.at(largest, place, errors)
    return np.where(largest < 0, np.nan, largest)


def _shares(at: np.ndarray, errors: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Share of errors in each interval. NaN in an interval without operands."""
    counts, wrong = np.histogram(at.ravel(), edges)[0], np.histogram(at.ravel()[errors], edges)[0]
    return np.divide(wrong, counts, out=np.full(len(counts), np.nan), where=counts > 0)


@dataclass(frozen=True)
class _Measured:
    label: str
    entry: Entry
    sample: Sample


def _distinct(entries: Sequence[Entry], samples: Sequence[Sample | None]) -> list[_Measured]:
    """Measured entries. Entries with equal results are merged."""
    found: list[_Measured] = []
    for entry, sample in zip(entries, samples, strict=True):
        if sample is None:
            continue
        for k, other in enumerate(found):
            if np.array_equal(other.sample.found, sample.found):
                common = [part for part in other.label.split(", ") if part in entry.name.split(", ")]
                found[k] = _Measured(", ".join(common), other.entry, other.sample)
                break
        else:
            found.append(_Measured(entry.name, entry, sample))
    return found


def _with_published(measured: Sequence[_Measured]) -> list[tuple[_Measured, _Measured | None]]:
    """Variants of a panel: a variant, and its form as published if there is one."""

    def parts(label):
        return set(label.split(", ")) - {"as published", "as_published", ""}

    found: list[tuple[_Measured, _Measured | None]] = []
    for m in measured:
        others = [
            k
            for k, (other, published) in enumerate(found)
            if published is None and parts(other.label) == parts(m.label)
        ]
        if m.entry.variant.as_published and others:
            found[others[0]] = (found[others[0]][0], m)
        else:
            found.append((m, None))
    return found


def _intervals(
    logarithmic: bool, first: np.ndarray, low: float, high: float, bins: int
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds and middles of the intervals of an axis. ``first`` are the operands of the first variant."""
    if logarithmic:
        low = 1.0 if low == 0 and np.all(first == np.rint(first)) else max(low, 1e-3)
        edges = np.geomspace(low, high, bins + 1)
        return edges, np.sqrt(edges[1:] * edges[:-1])
    edges = np.linspace(low, high, bins + 1)
    return edges, (edges[1:] + edges[:-1]) / 2


def draw_errors(entries: Sequence[Entry], samples: Sequence[Sample | None]) -> Figure:
    """Draw the largest errors against the axis of a unit: a panel for each variant and its published form.

    Parameters
    ----------
    entries : sequence of Entry
        Variants of the unit.
    samples : sequence of Sample or None
        Sample of each variant. ``None`` if the variant was not measured.
    """
    panels = _with_published(_distinct(entries, samples))
    columns = 2 if len(panels) == 4 else min(len(panels), 3)
    lines = -(-len(panels) // columns)
    single = len(panels) == 1
    figure = Figure(figsize=(5.6 if single else 2.9 * columns + 0.4, 2.9 if single else 1.9 * lines + 0.7))
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    measured = [m for panel in panels for m in panel if m]
    record, scale = measured[0].entry.record, measured[0].entry.variant.scale
    at = {id(m): np.broadcast_to(m.sample.at, np.shape(m.sample.found)).ravel() for m in measured}
    # All pixels of a span have the span's angle. An interval with a single span would show only chance.
    bins = min(90 if len(panels) <= 4 else 50, *(max(len(np.unique(a)) // 8, 2) for a in at.values()))
    low, high = min(a.min() for a in at.values()), max(a.max() for a in at.values())
    edges, middles = _intervals(record.logarithmic, at[id(measured[0])], low, high, bins)
    decides = isinstance(measured[0].sample, Decisions)
    floor = 0.0 if decides else max(m.sample.errors[2] for m in measured) * _DEPTH
    handles = {}
    for panel, (m, published) in zip(axes.flat, panels, strict=False):
        curves = [(name, errors, m) for name, errors in _curves_of(m.sample)]
        if published:
            curves.append((_PUBLISHED, _curves_of(published.sample)[-1][1], published))
        for name, errors, of in curves:
            values = (_shares if decides else _envelope)(at[id(of)], errors, edges)
            # With whole numbers as operands, some intervals are empty.
            has_any = ~np.isnan(values)
            values = values[has_any]
            # Errors near 0 would take up most of a logarithmic axis.
            values[values < floor] = np.nan
            (handles[name],) = panel.plot(middles[has_any], values, label=name, **_CURVES[name])
        if m.label:
            panel.set_title(m.label, fontsize=8)
        # Many panels are small, so vertical lines are left out.
        panel.grid(True, axis="both" if len(panels) <= 8 else "y", color="#dddddd", linewidth=0.5)
    for panel in axes.flat[len(panels) :]:
        panel.set_visible(False)
    for panel in axes.flat[max(len(panels) - columns, 0) : len(panels)]:
        panel.tick_params(labelbottom=True)
    _label(figure, axes, record, scale, decides)
    if len(handles) > 1:
        shown = [name for name in _CURVES if name in handles]
        figure.legend(
            [handles[name] for name in shown], shown, fontsize=7, loc="upper right", ncols=4, frameon=False
        )
    figure.tight_layout(
        rect=(0, 0, 1, 1 - 0.22 / figure.get_figheight()) if len(handles) > 1 else (0, 0, 1, 1)
    )
    return figure


def _label(figure: Figure, axes: np.ndarray, record: Record, scale: str, decides: bool) -> None:
    """Set the scales and labels of the axes."""
    if record.logarithmic:
        axes[0, 0].set_xscale("log")
    if not decides:
        axes[0, 0].set_yscale("log")
    for panel in axes.flat:
        panel.minorticks_off()
        if record.logarithmic:
            panel.xaxis.set_major_locator(LogLocator(numticks=5))
            panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        if not decides:
            panel.yaxis.set_major_locator(LogLocator(numticks=5))
            panel.yaxis.set_major_formatter(lambda value, _: re.sub("e([+-])0", r"e\1", f"{value:.0e}"))
    figure.supxlabel(record.axis, fontsize=8)
    label = f"largest error, {scale}" if scale else "largest error; 1: a full term, or a unit vector"
    figure.supylabel("share of all results" if decides else label, fontsize=8)


_CURVES = {
    "model": {"color": "#e3a376", "linewidth": 2.6},
    "arithmetic": {"color": "#5b8c3a", "linewidth": 0.9},
    "total": {"color": "#1f4e79", "linewidth": 1.3},
    _PUBLISHED: {"color": "#b03a2e", "linewidth": 1.1, "linestyle": (0, (4, 2))},
    "yes by mistake": {"color": "#1f4e79", "linewidth": 1.3},
    "no by mistake": {"color": "#b03a2e", "linewidth": 1.3},
}


def _curves_of(sample: Sample) -> list[tuple[str, np.ndarray]]:
    """Names of the curves of an entry, and the errors of every result. The last curve is the total error."""
    found, exact = np.asarray(sample.found), np.asarray(sample.exact)
    if isinstance(sample, Decisions):
        return [("yes by mistake", (found > exact).ravel()), ("no by mistake", (found < exact).ravel())]
    curves = [("total", found - exact)]
    if sample.errors[0]:
        curves = [("model", sample.formula - exact), ("arithmetic", found - sample.formula), *curves]
    return [(name, np.abs(errors).ravel()) for name, errors in curves]
