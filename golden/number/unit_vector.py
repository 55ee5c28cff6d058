"""Unit vectors as fixed-point codes.

A component is ``SQ(1, 17)``, 18 bits, the signed operand of an 18 x 18 multiplier. The code of length 1 is
``ONE = 2**17 - 1``, as in a signed-normalised texture format. So 1 and -1 are both exact, and a vector along
an axis is exactly a unit vector. As a fixed-point number, the length of every unit vector is ``ONE / 2**17``.
So a dot product of two unit vectors of angle a is ``(ONE / 2**17)**2 * cos(a)``, and `ONE_SQUARED` stands for
1.

Source: docs/theory/interpolation.md#spans.
"""

import numpy as np

from blysk.golden.number.fixed import SQ, Fixed

__all__ = [
    "CODE_LENGTH_ERROR",
    "COMPONENT",
    "ONE",
    "ONE_SQUARED",
    "quantise",
    "values",
]

COMPONENT = SQ(1, 17)
"""Number format of one component."""

ONE = COMPONENT.max_code
"""Code of length 1."""

ONE_SQUARED = Fixed((COMPONENT * COMPONENT), ONE * ONE)
"""Dot product of a unit vector with itself."""

CODE_LENGTH_ERROR = 3**0.5 * COMPONENT.step / 2 * (1 + 2.0**-10)
"""Largest error of a vector's length if its components are rounded. `quantise` stays within this error."""


def quantise(vectors: np.ndarray) -> np.ndarray:
    """Codes of unit vectors. Their length is nearer to 1 than the length of rounded components.

    A vector has eight neighbours on the grid of codes. The result is the neighbour whose length is nearest to
    1. Near the peak of a highlight an error of the normal's length changes the specular term at first order.
    An error of its direction changes it only at second order. The error of a component is under one step,
    ``2**-17``.

    Parameters
    ----------
    vectors : float64 array, shape (..., 3)
        Unit vectors, of length 1 within 1e-6.

    Returns
    -------
    int64 array, same shape
        Codes from ``-ONE`` to ``ONE``.

    Raises
    ------
    ValueError
        If a vector is not of unit length.
    """
    vectors = np.asarray(vectors, dtype=np.float64)
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    if not np.all(np.abs(length - 1) < 1e-6):
        raise ValueError("vectors must have unit length")
    scaled = vectors * ONE
    low = np.floor(scaled).astype(np.int64)
    # If a component is a whole code, both of its neighbours are this code.
    high = np.ceil(scaled).astype(np.int64)
    squares = [np.moveaxis(codes * codes, -1, 0) for codes in (low, high)]
    smallest = np.full(low.shape[:-1], np.iinfo(np.int64).max)
    best = np.zeros(low.shape[:-1], dtype=np.uint8)
    # Bit i of a corner: component i is the higher of its two neighbours.
    for corner in range(8):
        total = sum(squares[corner >> axis & 1][axis] for axis in range(3))
        miss = np.abs(total - ONE * ONE)
        best[miss < smallest] = corner
        np.minimum(smallest, miss, out=smallest)
    upper = (best[..., np.newaxis] >> np.arange(3, dtype=np.uint8) & 1).astype(bool)
    found: np.ndarray = np.clip(np.where(upper, high, low), -ONE, ONE)
    return found


def values(codes: np.ndarray) -> np.ndarray:
    """Components in float64, ``codes / ONE``."""
    return np.asarray(codes) / ONE
