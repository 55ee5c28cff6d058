"""Reflection models: the brightness of a highlight as a function of one cosine, in float64."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.optimize import brentq

__all__ = [
    "COSCOS_MODELS",
    "LINE_MODELS",
    "REFLECTION_MODELS",
    "coscos_scale",
    "energy_factor",
    "exponent_ratio",
    "reflect",
    "slope",
]

# The level at which cosquad_q meets Blinn's power exactly; 0.64 is the best of [C].
_Q = 0.64

# Slope and power of every model of the form max(k (c - 1) + 1, 0)^p.
_LINES: dict[str, tuple[Callable[[float], float], int]] = {
    "cosquad": (lambda n: n / 2, 2),
    "cosquad7": (lambda n: 7 * n / 16, 2),
    "cosquad_q": (lambda n: (math.sqrt(_Q) - 1) / math.expm1(math.log(_Q) / n), 2),
    "cosquad_lin": (lambda n: 0.448 * n + 0.099, 2),
    "cosquad_lin_refitted": (lambda n: 0.44813 * n + 0.10235, 2),
    "lyon2": (lambda n: n / 4, 4),
    "lyon3": (lambda n: n / 8, 8),
    "lyon1_refitted": (lambda n: 0.3557 * n + 0.2457, 2),
    "lyon2_refitted": (lambda n: 0.2113 * n + 0.1468, 4),
    "lyon3_refitted": (lambda n: 0.1150 * n + 0.0799, 8),
}

COSCOS_MODELS = {
    "coscos2": (2, "taylor"),
    "coscos4": (4, "taylor"),
    "coscos2_integral": (2, "integral"),
    "coscos4_integral": (4, "integral"),
}
"""Power k of the models ``cos^k(a gamma)``, and the rule by which `coscos_scale` finds a."""

LINE_MODELS = tuple(_LINES)
"""Names of the models that raise a line to a power, which `slope` knows."""

REFLECTION_MODELS = ("phong", "blinn", *LINE_MODELS, *COSCOS_MODELS, "exp")
"""Names of the models. ``phong`` takes the cosine R·V, all others N·H."""


def _check_exponent(exponent: float) -> float:
    exponent = float(exponent)
    if not (math.isfinite(exponent) and exponent > 0):
        raise ValueError(f"exponent must be finite and greater than 0, not {exponent}")
    return exponent


def slope(model: str, exponent: float) -> float:
    """Slope k of a line model ``max(k (c - 1) + 1, 0)^p``.

    ======================== ================================= === ====================
    model                    k                                 p   source
    ======================== ================================= === ====================
    ``cosquad`` (f2)         ``n / 2``                         2   [T] 3.4, fig. 3.6
    ``cosquad7`` (W3)        ``7 n / 16``                      2   [T] fig. 3.7
    ``cosquad_q`` (fQ)       ``(sqrt(Q)-1) / (Q^(1/n)-1)``,    2   [C]
                             ``Q = 0.64``
    ``cosquad_lin`` (fQ2)    ``0.448 n + 0.099``               2   [C]
    ``cosquad_lin_refitted`` ``0.44813 n + 0.10235``           2   line through the slope
                                                                   of ``cosquad_q``
    ``lyon2``, ``lyon3``     ``n / 4``, ``n / 8``              4,8 Lyon 1993
    ``lyon1_refitted``       ``0.3557 n + 0.2457``             2   minimax over the
                                                                   whole range
    ``lyon2_refitted``       ``0.2113 n + 0.1468``             4   the same
    ``lyon3_refitted``       ``0.1150 n + 0.0799``             8   the same
    ======================== ================================= === ====================

    Lyon's model is ``max(1 - x/2^j, 0)^(2^j)`` with ``x = n (1 - c)``, which tends to ``exp(-x)``; its
    first, j = 1, is ``cosquad``.

    Parameters
    ----------
    model : str
        One of `LINE_MODELS`.
    exponent : float
        The exponent n of Blinn's model that is approximated, greater than 0.

    Raises
    ------
    ValueError
        If the model has no slope, or the exponent is not finite and positive.
    """
    exponent = _check_exponent(exponent)
    if model not in _LINES:
        raise ValueError(f"model must be one of {', '.join(LINE_MODELS)}, not {model!r}")
    return _LINES[model][0](exponent)


_gauss = cache(np.polynomial.legendre.leggauss)


def coscos_scale(exponent: float, power: int, rule: str = "taylor") -> float:
    """Scale a of the model ``cos^k(a gamma)``, which stands for ``cos^n gamma``.

    ============ ======================================================================================
    rule         a
    ============ ======================================================================================
    ``taylor``   ``sqrt(n/k)``: both agree at gamma = 0 to the third power of gamma
    ``integral`` both have the same integral over their own range, weighted with ``sin gamma``:
                 ``1/(n+1) = integral_0^{pi/(2a)} cos^k(a g) sin g dg``, which for k = 2 is
                 ``(2a^2 (1 - cos(pi/(2a))) - 1) / (4a^2 - 1)``
    ============ ======================================================================================

    Parameters
    ----------
    exponent : float
        Exponent n, greater than 0.
    power : int
        Power k, 2 or 4.
    rule : str
        ``"taylor"`` or ``"integral"``.

    Raises
    ------
    ValueError
        If the exponent is not finite and positive, the power or the rule is unknown, or the exponent is
        under 1/2 for equal integrals with k = 4: the lobe would then have to be wider than the sphere.

    Notes
    -----
    Source: [T] 3.1.
    """
    exponent = _check_exponent(exponent)
    if power not in (2, 4):
        raise ValueError(f"power must be 2 or 4, not {power!r}")
    if rule == "taylor":
        return math.sqrt(exponent / power)
    if rule != "integral":
        raise ValueError(f"rule must be 'taylor' or 'integral', not {rule!r}")
    if power == 4 and exponent < 0.5:
        raise ValueError(f"equal integrals with power 4 need an exponent of at least 0.5, not {exponent}")
    # Gauss-Legendre on an interval of at most pi: exact to rounding for a trigonometric polynomial.
    nodes, weights = _gauss(40)

    def excess(scale: float) -> float:
        half = math.pi / (4 * scale)
        angle = (nodes + 1) * half
        lobe = np.cos(scale * angle) ** power * np.sin(angle)
        return float(half * (weights @ lobe)) - 1 / (exponent + 1)

    # At a = 1/2 the lobe covers the sphere; far out it falls like 0.6/a^2 at most.
    return float(brentq(excess, 0.5, 1 + math.sqrt(exponent + 1), xtol=1e-15, rtol=1e-14))


def reflect(model: str, cosine: np.ndarray, exponent: float) -> np.ndarray:
    """Brightness S of a highlight, 0 to 1.

    ====================== ============================================================================
    model                  S
    ====================== ============================================================================
    ``phong``, ``blinn``   ``max(c, 0)^n``
    `LINE_MODELS`          ``max(k (c - 1) + 1, 0)^p`` with `slope`'s k and p; the base is gated, never
                           the power, so the parabola's second lobe does not show
    ``coscos2``,           ``cos^k(a gamma)`` where ``a gamma <= pi/2``, else 0; k = 2 or 4, a from
    ``coscos4``            `coscos_scale` by Taylor; ``coscos2_integral``, ``coscos4_integral``: by equal
                           integrals
    ``exp``                ``exp(n (c - 1))``
    ====================== ============================================================================

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
        If the model is unknown, or the exponent is not finite and positive, or too small for the model.

    Notes
    -----
    Sources: [B] 2 and 3, [T] 3.1, 3.4 and 6, [C], Lyon 1993.
    """
    exponent = _check_exponent(exponent)
    cosine = np.minimum(np.asarray(cosine, dtype=np.float64), 1.0)
    if model in ("phong", "blinn"):
        return np.maximum(cosine, 0.0) ** exponent
    if model in _LINES:
        line, power = _LINES[model]
        base = np.maximum(line(exponent) * (cosine - 1.0) + 1.0, 0.0)
        while power > 1:
            base, power = base * base, power // 2
        return base
    if model in COSCOS_MODELS:
        power, rule = COSCOS_MODELS[model]
        angle = coscos_scale(exponent, power, rule) * np.arccos(np.maximum(cosine, -1.0))
        return np.cos(np.minimum(angle, math.pi / 2)) ** power * (angle < math.pi / 2)
    if model == "exp":
        return np.exp(exponent * (cosine - 1.0))
    raise ValueError(f"model must be one of {', '.join(REFLECTION_MODELS)}, not {model!r}")


def energy_factor(model: str, exponent: float) -> float:
    """Factor that normalises a model's reflected energy: the energy-normalised form is factor times S.

    =============== ========================================== =========================================
    model           factor                                     1 over
    =============== ========================================== =========================================
    ``phong``       ``(n+2) / (2 pi)``                         ``2 pi integral_0^1 c^n c dc``
    ``blinn``       ``(n+2)(n+4) / (8 pi (2^(-n/2) + n))``     ``integral cos^n(t/2) cos t`` over the
                                                               hemisphere: viewer along the normal
    ``cosquad_lin`` ``0.214 (0.807 + n)``                      a line through ``2 pi integral_0^1 S(c) c
                                                               dc``, off by at most 0.0533 for n >= 2
    =============== ========================================== =========================================

    [C] integrates ``cosquad_lin`` over the angle itself, as for ``phong``, not over the half angle.

    Parameters
    ----------
    model : str
        ``"phong"``, ``"blinn"`` or ``"cosquad_lin"``.
    exponent : float
        Exponent n, greater than 0.

    Raises
    ------
    ValueError
        If the model is another, or the exponent is not finite and positive.

    Notes
    -----
    Source: [C], which prints n for pi in the denominators and n/2 for the exponent -n/2.
    """
    exponent = _check_exponent(exponent)
    if model == "phong":
        return (exponent + 2) / (2 * math.pi)
    if model == "blinn":
        return (exponent + 2) * (exponent + 4) / (8 * math.pi * (2 ** (-exponent / 2) + exponent))
    if model == "cosquad_lin":
        return 0.214 * (0.807 + exponent)
    raise ValueError(f"model must be phong, blinn or cosquad_lin, not {model!r}")


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
