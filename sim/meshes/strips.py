"""Triangles of strips."""

import numpy as np

__all__ = ["strip_triangles"]


def strip_triangles(corners: np.ndarray) -> np.ndarray:
    """Triangles of strips. Triangle i has the corners i, i + 1, i + 2, in reverse order if i is odd.

    A triangle with the same corner twice only joins two strips, and is left out.

    Parameters
    ----------
    corners : int ndarray, shape (n,)
        Vertices of the strips, with -1 between one strip and the next.

    Returns
    -------
    int64 ndarray, shape (T, 3)
    """
    corners = np.asarray(corners, dtype=np.int64)
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    triangles = np.lib.stride_tricks.sliding_window_view(corners, 3).copy()
    places = np.arange(len(corners))
    starts = np.maximum.accumulate(np.where(corners == -1, places + 1, 0))
    odd = (places - starts)[:-2] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    a, b, c = triangles.T
    return triangles[(triangles >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)]
