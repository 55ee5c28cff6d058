"""Measurements of ways in software: ratios of times, counts of operations, prices of operations."""

from collections import Counter, deque
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from blysk.bench.report.counted import DEAR, Counted, fastest
from blysk.bench.report.thesis_ways import SPANS, WAYS, random_operands

__all__ = ["counted", "price", "prices", "software"]


@cache
def counted(way: str, pixels: int) -> dict[str, float]:
    """Operations for each result of a way, by kind (see `Counted`). Operations of the setup count, too."""
    counts: Counter[str] = Counter()
    found = sum(1 for _ in WAYS[way](*(Counted.of(x, counts) for x in random_operands()), pixels))
    return {kind: count / (found * SPANS) for kind, count in counts.items()}


def price(printed: float, own: dict[str, float], other: dict[str, float]) -> float | None:
    """Cost of a costly operation, in cheap operations, at which the counts give the printed ratio."""
    dear = [sum(counts.get(kind, 0.0) for kind in DEAR) for counts in (own, other)]
    cheap = [sum(counts.values()) - of for counts, of in zip((own, other), dear, strict=True)]
    gain = dear[1] - printed * dear[0]
    return max((printed * cheap[0] - cheap[1]) / gain, 0.0) if gain > 0 else None


def _shown(counts: dict[str, float]) -> str:
    return ", ".join(f"{kind} {count:.2g}" for kind, count in counts.items())


def software(way: str, baseline: str, pixels: int, printed: float, repeats: int) -> dict[str, Any]:
    """Two ways in software on the same spans: ratio of times, operations for each result, largest difference.

    Both ways are NumPy in float64, vectorised over `SPANS` random spans of up to 45 degrees. The setup is
    included.

    Parameters
    ----------
    way, baseline : str
        Two of `WAYS`.
    pixels : int
        Pixels of each span. For a bisection this is p, a power of two. The bisection has p - 1 results, in a
        span of p + 1 pixels.
    printed : float
        Claimed ratio of speeds.
    repeats : int
        Runs of each way. The fastest run counts.

    Returns
    -------
    dict
        - ``ratio``: time of the baseline, divided by the time of the way;
        - ``own``, ``other``: `counted` of both, in words;
        - ``price``: the result of `price` for both counts;
        - ``difference``: largest difference of a component of a normal, or of a cosine.
    """
    operands = random_operands()
    pair = WAYS[way], WAYS[baseline]
    results = zip(*(one(*operands, pixels) for one in pair), strict=True)
    difference = max(float(np.abs(ours - theirs).max()) for ours, theirs in results)
    # Several runs are timed together, so that a time is longer than a few microseconds.
    runs = max(1, 64 // pixels)
    time, baseline_time = fastest(
        [lambda one=one: [_finish(one(*operands, pixels)) for _ in range(runs)] for one in pair], repeats
    )
    counts = counted(way, pixels), counted(baseline, pixels)
    return {
        "ratio": baseline_time / time,
        "difference": difference,
        "price": price(printed, *counts),
        "own": _shown(counts[0]),
        "other": _shown(counts[1]),
    }


def _finish(results: Iterable) -> None:
    """Compute all results without keeping them."""
    deque(results, maxlen=0)


def prices(repeats: int) -> dict[str, float]:
    """Times of a division, a root and a cosine in NumPy, as ratios to a multiplication.

    Parameters
    ----------
    repeats : int
        Runs of each operation. The fastest run counts.
    """
    x = np.random.default_rng(1).uniform(0.5, 1, SPANS)
    actions = {"a multiplication": lambda: x * x, "a division": lambda: x / x}
    actions |= {"a root": lambda: np.sqrt(x), "a cosine": lambda: np.cos(x)}
    # Many actions are timed together, because a single action takes only microseconds.
    loops = [lambda action=action: [action() for _ in range(100)] for action in actions.values()]
    product, *times = fastest(loops, repeats)
    return {name: time / product for name, time in zip(list(actions)[1:], times, strict=True)}
