"""Reflection models: the brightness of a highlight as a function of one cosine, in float64."""

import math

import numpy as np

__all__ = ["REFLECTION_MODELS", "exponent_ratio", "reflect", "slope"]

REFLECTION_MODELS = ("phong", "blinn", "cosquad", "cosquad7", "cosquad_q", "cosquad_lin")
"""Names of the models. ``phong`` takes the cosine R·V, all others N·H."""

# The level at which cosquad_q meets Blinn's power exactly; 0.64 is the best of [C].
_Q = 0.64


def _check_exponent(exponent: float) -> float:
    exponent = float(exponent)
    if not (math.isfinite(exponent) and exponent > 0):
        raise ValueError(f"exponent must be finite and greater than 0, not {exponent}")
    return exponent


def slope(model: str, exponent: float) -> float:
    """Slope k of a squared-line model ``max(k (c - 1) + 1, 0)^2``.

    ======================= ================================= ====================
    model                   k                                 source
    ======================= ================================= ====================
    ``cosquad`` (f2)        ``n / 2``                         [T] 3.4, fig. 3.6
    ``cosquad7`` (W3)       ``7 n / 16``                      [T] fig. 3.7
    ``cosquad_q`` (fQ)      ``(sqrt(Q)-1) / (Q^(1/n)-1)``,    [C]
                            ``Q = 0.64``
    ``cosquad_lin`` (fQ2)   ``0.448 n + 0.099``               [C]
    ======================= ================================= ====================

    Parameters
    ----------
    model : str
        One of the four ``cosquad`` models.
    exponent : float
        The exponent n of Blinn's model that is approximated, greater than 0.

    Raises
    ------
    ValueError
        If the model has no slope, or the exponent is not finite and positive.
    """
    exponent = _check_exponent(exponent)
    if model == "cosquad":
        return exponent / 2
    if model == "cosquad7":
        return 7 * exponent / 16
    if model == "cosquad_q":
        return (math.sqrt(_Q) - 1) / math.expm1(math.log(_Q) / exponent)
    if model == "cosquad_lin":
        return 0.448 * exponent + 0.099
    raise ValueError(f"model must be one of {', '.join(REFLECTION_MODELS[2:])}, not {model!r}")


def reflect(model: str, cosine: np.ndarray, exponent: float) -> np.ndarray:
    """Brightness S of a highlight, 0 to 1.

    ``max(c, 0)^n`` for ``phong`` and ``blinn``, ``max(k (c - 1) + 1, 0)^2`` with `slope`'s k for
    the others. The base is gated, never the square, so the parabola's second lobe does not show.

    Parameters
    ----------
    model : str
        One of `REFLECTION_MODELS`.
    cosine : array
        R·V for ``phong``, N·H for the others. Values above 1, which vectors that are not quite of unit
        length give, count as 1.
    exponent : float
        Exponent n, greater than 0.

    Returns
    -------
    float64 array, the shape of ``cosine``

    Raises
    ------
    ValueError
        If the model is unknown, or the exponent is not finite and positive.

    Notes
    -----
    Sources: [B] 2 and 3, [T] 3.4 and 6, [C].
    """
    exponent = _check_exponent(exponent)
    cosine = np.minimum(np.asarray(cosine, dtype=np.float64), 1.0)
    if model in ("phong", "blinn"):
        return np.maximum(cosine, 0.0) ** exponent
    if model in REFLECTION_MODELS:
        base = np.maximum(slope(model, exponent) * (cosine - 1.0) + 1.0, 0.0)
        return base * base
    raise ValueError(f"model must be one of {', '.join(REFLECTION_MODELS)}, not {model!r}")


def exponent_ratio(cosine: np.ndarray) -> np.ndarray:
    """Blinn's exponent over Phong's for the same brightness at the half-way angle gamma.

    For coplanar vectors the angle between R and V is ``2 gamma``, so ``c^n = (2c^2 - 1)^p`` gives
    ``n / p = ln(2c^2 - 1) / ln c``, which tends to 4 as gamma tends to 0 ([P]).

    Parameters
    ----------
    cosine : array
        ``c = cos gamma``, greater than ``1/sqrt(2)`` and at most 1.

    Returns
    -------
    float64 array, the shape of ``cosine``

    Raises
    ------
    ValueError
        If a cosine is out of range.
    """
    cosine = np.asarray(cosine, dtype=np.float64)
    if not ((2 * cosine * cosine > 1) & (cosine > 0) & (cosine <= 1)).all():
        raise ValueError("cosine must be greater than 1/sqrt(2) and at most 1")
    # In s = 1 - c both logarithms are log1p of a small number, which keeps their digits near c = 1.
    small = 1 - cosine
    limit = small == 0
    small = np.where(limit, 0.125, small)
    return np.where(limit, 4.0, np.log1p(2 * small * (small - 2)) / np.log1p(-small))
