"""Costs of ways in software: operations, counted while the ways run, and the least times of the ways."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from blysk.bench.speed.renderer_times import timed

__all__ = ["DEAR", "Counted", "dot", "fastest"]

DEAR = ("divisions", "roots", "functions")
"""Kinds of operations that cost more than a product or a sum."""


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot products of the columns of two arrays of three rows, by operations that `Counted` counts."""
    product = a * b
    return product[0] + product[1] + product[2]


class Counted(np.ndarray):
    """An array that counts in `counts` the operations on it and on their results.

    An operation on arrays counts once for each element. `Counted.of` makes the array.
    """

    counts: Counter[str]

    _KINDS: ClassVar[dict[str, str]] = {
        "multiply": "multiplications",
        "add": "additions",
        "subtract": "additions",
        "negative": "additions",
        "divide": "divisions",
        "sqrt": "roots",
        "cos": "functions",
        "sin": "functions",
        "arccos": "functions",
        "arctan2": "functions",
        "power": "functions",
        "maximum": "comparisons",
    }

    @classmethod
    def of(cls, values: np.ndarray, counts: Counter[str]) -> "Counted":
        """Values whose operations count in ``counts``.

        The kinds are multiplications, additions, divisions, roots, functions and comparisons. A subtraction
        counts as an addition.
        """
        counted = np.asarray(values, dtype=np.float64).view(cls)
        counted.counts = counts
        return counted

    def __array_finalize__(self, source):
        self.counts = getattr(source, "counts", Counter())

    def __array_function__(self, function, types, arguments, options):
        """Keep counting in the results of functions, such as stacks of arrays."""
        result = super().__array_function__(function, types, arguments, options)
        return self.of(result, self.counts) if isinstance(result, np.ndarray) else result

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        """Count, and work on plain arrays."""
        plain = [x.view(np.ndarray) if isinstance(x, Counted) else x for x in inputs]
        counts = next(x.counts for x in inputs if isinstance(x, Counted))
        result = getattr(ufunc, method)(*plain, **options)
        counts[self._KINDS[ufunc.__name__]] += np.size(result)
        return self.of(result, counts)


def fastest(actions: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Least processor time of each of several actions, in seconds. The actions run in turn.

    The time is the sum over all threads. Other processes do not count.

    Parameters
    ----------
    actions : sequence of callables
        Actions to time.
    repeats : int
        Number of runs of each action.
    """
    times = [[timed(action, 1)[0].cpu for action in actions] for _ in range(repeats)]
    return np.min(times, axis=0).tolist()
