"""Curves of a normal along a span, from its first pixel centre to its last, in float64."""

import numpy as np

from blysk.golden.reference.geometry import normalise

__all__ = ["CURVES", "interpolate"]

CURVES = ("linear", "normalised", "slerp", "quadratic")
"""Names of the curves."""


def interpolate(curve: str, normal_left: np.ndarray, normal_right: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Normal at the position t of a span.

    With ``r = N_l·N_r`` and ``psi = arccos r``:

    - ``linear``: ``(1-t) N_l + t N_r``;
    - ``normalised``: the line divided by its length. Between unit ends it differs from the true curve of a
      surface (docs/theory/interpolation.md#true-spans);
    - ``slerp``: ``(sin((1-t) psi) N_l + sin(t psi) N_r) / sin psi`` ([T] 2.1), computed as
      ``cos(t psi) N_l + sin(t psi) U``, with the unit vector U at right angles to N_l in the plane of both;
    - ``quadratic``: ``G t^2 + P t + Q`` through N_l, ``N_c = (N_l + N_r) / sqrt(2 (1 + r))`` at ``t = 1/2``
      and N_r: ``G = 2 (N_l - 2 N_c + N_r)``, ``P = 4 N_c - 3 N_l - N_r``, ``Q = N_l`` ([T] 2.2).

    Equal normals give this normal everywhere. Opposite normals (``r = -1`` to within 1e-12) have no plane and
    no middle:

    - ``normalised`` jumps from N_l to N_r, and is 0 at ``t = 1/2``;
    - ``quadratic`` takes ``N_c = 0``, which makes it ``linear``;
    - ``slerp`` passes through the vector at right angles to N_l and to the axis of N_l's smallest component.

    Parameters
    ----------
    curve : str
        One of `CURVES`.
    normal_left, normal_right : arrays, shape (..., 3)
        Unit normals N_l and N_r.
    t : array, shape (...)
        Positions in [0, 1]; broadcast against the normals without their last axis.

    Returns
    -------
    float64 array, shape (..., 3)

    Raises
    ------
    ValueError
        If the curve is unknown.
    """
    if curve not in CURVES:
        raise ValueError(f"curve must be one of {', '.join(CURVES)}, not {curve!r}")
    left = np.asarray(normal_left, dtype=np.float64)
    right = np.asarray(normal_right, dtype=np.float64)
    t = np.asarray(t, dtype=np.float64)[..., np.newaxis]
    if curve == "linear":
        return (1 - t) * left + t * right
    if curve == "normalised":
        return normalise((1 - t) * left + t * right)
    r = (left * right).sum(axis=-1, keepdims=True)
    opposite = 1 + r <= 1e-12
    if curve == "slerp":
        side = right - r * left
        sine = np.sqrt((side * side).sum(axis=-1, keepdims=True))
        unit = np.divide(side, sine, out=np.zeros_like(side), where=sine > 0)
        if opposite.any():
            axis = np.eye(3)[np.abs(left).argmin(axis=-1)]
            unit = np.where(opposite, normalise(np.cross(left, axis)), unit)
        # The form with two arguments keeps the digits that arccos r loses near r = 1.
        angle = np.where(opposite, np.pi, np.arctan2(sine, r))
        found: np.ndarray = np.cos(t * angle) * left + np.sin(t * angle) * unit
        return found
    total = left + right
    length = np.sqrt(np.where(opposite, 1.0, 2 * (1 + r)))
    middle = np.where(opposite, 0.0, total / length)
    normals: np.ndarray = (2 * (total - 2 * middle) * t + (4 * middle - 3 * left - right)) * t + left
    return normals
