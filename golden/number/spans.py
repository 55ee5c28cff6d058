"""Lengths of spans, and which pixel belongs to which span."""

from collections.abc import Iterator

import numpy as np

__all__ = ["LENGTH_BITS", "checked_lengths", "pixels_of", "runs_of"]

LENGTH_BITS = 12
"""Bits of a span's length in pixels."""


def checked_lengths(length: np.ndarray, least: int = 1) -> np.ndarray:
    """Lengths of spans as int64, checked.

    Parameters
    ----------
    length : int array
        Pixels of each span.
    least : int
        Least length that a unit takes.

    Raises
    ------
    ValueError
        If a length is under ``least`` or over 4095.
    """
    length = np.asarray(length, dtype=np.int64)
    if length.size and not least <= length.min() <= length.max() < 1 << LENGTH_BITS:
        raise ValueError(f"lengths must be {least} to {(1 << LENGTH_BITS) - 1}")
    return length


def pixels_of(length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the span of each pixel, and index of the pixel in its span, both from 0 on.

    Parameters
    ----------
    length : int array, shape (spans,)
        Pixels of each span, 0 or more.

    Returns
    -------
    span, index : int64 arrays, shape (pixels,)
        In raster order.
    """
    span = np.repeat(np.arange(len(length)), length)
    return span, np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)


def runs_of(length: np.ndarray, most: int = 1 << 18) -> Iterator[slice]:
    """Slices of consecutive spans with at most ``most`` pixels, or of a single longer span. They bound the
    memory.

    Parameters
    ----------
    length : int array, shape (spans,)
        Number of pixels of each span.
    most : int
        Largest number of pixels of a slice.
    """
    ends = np.cumsum(length)
    start = 0
    while start < len(length):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + most, side="right")), start + 1)
        yield slice(start, stop)
        start = stop
