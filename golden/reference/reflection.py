"""Reflection models: the brightness of a highlight as a function of one cosine, in float64."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

__all__ = [
    "BLINN",
    "COSQUAD",
    "PHONG",
    "REFLECTION_MODELS",
    "AngleCosine",
    "Exponential",
    "PolynomialModel",
    "PowerModel",
    "ReflectionModel",
    "coscos_scale",
    "exponent_ratio",
]


def _check_exponent(exponent: float | None) -> float:
    if exponent is None:
        raise ValueError("exponent must be given")
    exponent = float(exponent)
    if not (math.isfinite(exponent) and exponent > 0):
        raise ValueError(f"exponent must be finite and greater than 0, not {exponent}")
    return exponent


@dataclass(frozen=True)
class ReflectionModel:
    """A lobe: brightness S, 0 to 1, by cosine and parameter. Each family of models is a subclass.

    The parameter is one number for the width of the highlight: an exponent, or the roughness of the
    microfacets in `lobes`. A `lobes.TabulatedModel` has none.

    Parameters
    ----------
    name : str
        Name on the command line and in tables.
    source : str
        Source of the formula; see docs/theory/models.md.
    summary : str
        The model in a few words, for the help of the command line.
    energy : callable, optional
        Function from the parameter to the factor that normalises the reflected energy; see `energy_factor`.

    Attributes
    ----------
    MIRROR : bool
        Whether the cosine is R·V, with the mirror direction R, in place of N·H.
    PARAMETER : str or None
        Name of the parameter: ``"exponent"``, ``"roughness"``, or ``None`` without a parameter.
    """

    name: str
    source: str = ""
    summary: str = ""
    energy: Callable[[float], float] | None = None

    MIRROR: ClassVar[bool] = False
    PARAMETER: ClassVar[str | None] = "exponent"

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"

    def __reduce__(self) -> str | tuple[Any, ...]:
        # A function without a name cannot be sent to another process, but the name of its model can.
        if REFLECTION_MODELS.get(self.name) is self:
            return _registered, (self.name,)
        return super().__reduce__()

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        raise NotImplementedError

    def _checked(self, parameter: float | None) -> float:
        return _check_exponent(parameter)

    def reflect(self, cosine: npt.ArrayLike, parameter: float | None) -> np.ndarray:
        """Brightness S of a highlight, 0 to 1.

        Parameters
        ----------
        cosine : array
            N·H, or R·V for a model with `MIRROR`. Values above 1, from vectors that are not exactly of unit
            length, count as 1.
        parameter : float
            Exponent n, greater than 0, or the roughness, see `PARAMETER`. Approximations of Blinn's model
            take its exponent.

        Returns
        -------
        float64 array, the shape of ``cosine``

        Raises
        ------
        ValueError
            If the exponent is not finite and positive, or too small for the model; or the roughness is not
            greater than 0 and at most 1.
        """
        return self._lobe(np.minimum(np.asarray(cosine, dtype=np.float64), 1.0), self._checked(parameter))

    def steepness(self, parameter: float | None) -> float:
        """Exponent of the Blinn power with the same steepest slope. It decides how fine spans must be.

        It is the exponent of the model. For the models of `lobes` it is the largest ``|dS/dc|``, from 1 to
        10,000.

        Raises
        ------
        ValueError
            If the parameter is out of range.
        """
        return self._checked(parameter)

    def energy_factor(self, parameter: float | None) -> float:
        """Factor of the energy-normalised form, which is this factor times S ([C]).

        =============== ==================================== ==============================================
        model           factor                               1 over
        =============== ==================================== ==============================================
        ``phong``       ``(n+2) / (2 pi)``                   ``2 pi integral_0^1 c^n c dc``
        ``blinn``       ``(n+2)(n+4) / (8 pi (2^(-n/2)+n))`` ``integral cos^n(t/2) cos t`` over the
                                                             hemisphere, viewer along the normal
        ``cosquad_lin`` ``0.214 (0.807 + n)``                a line through ``2 pi integral_0^1 S(c) c
                                                             dc``, off by at most 0.0533 for n >= 2
        microfacets     see `MicrofacetModel`                integral of ``blinn`` with their S
        =============== ==================================== ==============================================

        [C] integrates ``cosquad_lin`` over the angle itself, as ``phong``. Our text of [C] was read by a
        machine. It has n for pi in the denominators and n/2 for the exponent -n/2.

        Parameters
        ----------
        parameter : float
            Exponent n, greater than 0; or the roughness, see `PARAMETER`.

        Raises
        ------
        ValueError
            If the model has no such form, or the parameter is out of range.
        """
        if self.energy is None:
            known = ", ".join(name for name, model in REFLECTION_MODELS.items() if model.energy)
            raise ValueError(f"model must be one of {known}, not {self.name}")
        return self.energy(self._checked(parameter))


@dataclass(frozen=True, repr=False)
class PowerModel(ReflectionModel):
    """``max(c, 0)^n``: with c = N·H Blinn's model ([B] 3), with c = R·V Phong's ([T] 6, [B] 2)."""

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        powers: np.ndarray = np.maximum(cosine, 0.0) ** exponent
        return powers


@dataclass(frozen=True, repr=False)
class _MirrorPowerModel(PowerModel):
    MIRROR = True


@dataclass(frozen=True, repr=False)
class PolynomialModel(ReflectionModel):
    """``max(k (c - 1) + 1, 0)^(2^squarings)``, slope k: the cosine-quadratic family and Lyon's.

    The base is compared with 0, so the parabola's second lobe does not show. Lyon's models are
    ``max(1 - x/2^j, 0)^(2^j)`` with ``x = n (1 - c)``, which tends to ``exp(-x)``; j = 1 is ``cosquad``.

    Parameters
    ----------
    a, b : float
        Coefficients of the slope ``k = a n + b``.
    squarings : int
        How often the base is squared, 1 to 3: the power is 2, 4 or 8.
    curve : callable, optional
        Slope by exponent, if the slope is not a line. Hardware then has a table of slopes.

    Raises
    ------
    ValueError
        If the number of squarings is not 1 to 3.
    """

    a: float = 0.0
    b: float = 0.0
    squarings: int = 1
    curve: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        if self.squarings not in (1, 2, 3):
            raise ValueError(f"{self.name}: squarings must be 1, 2 or 3, not {self.squarings!r}")

    def slope(self, exponent: float) -> float:
        """Slope k at an exponent.

        Raises
        ------
        ValueError
            If the exponent is not finite and positive.
        """
        exponent = _check_exponent(exponent)
        return self.curve(exponent) if self.curve else self.a * exponent + self.b

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        base = np.maximum(self.slope(exponent) * (cosine - 1.0) + 1.0, 0.0)
        for _ in range(self.squarings):
            base = base * base
        return base


@dataclass(frozen=True, repr=False)
class AngleCosine(ReflectionModel):
    """Power of a cosine of ``a gamma``: ``cos^k(a gamma)`` where ``a gamma <= pi/2``, else 0 ([T] 3.1).

    Parameters
    ----------
    power : int
        Power k, 2 or 4.
    rule : str
        Rule by which `coscos_scale` computes a: ``"taylor"`` or ``"integral"``.
    """

    power: int = 2
    rule: str = "taylor"

    def scale(self, exponent: float) -> float:
        """Scale a at an exponent; see `coscos_scale`."""
        return coscos_scale(exponent, self.power, self.rule)

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        angle = self.scale(exponent) * np.arccos(np.maximum(cosine, -1.0))
        powers: np.ndarray = np.cos(np.minimum(angle, math.pi / 2)) ** self.power * (angle < math.pi / 2)
        return powers


@dataclass(frozen=True, repr=False)
class Exponential(ReflectionModel):
    """``exp(n (c - 1))``, the limit of Blinn's power for large n."""

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        return np.exp(exponent * (cosine - 1.0))


_gauss = cache(np.polynomial.legendre.leggauss)


def coscos_scale(exponent: float, power: int, rule: str = "taylor") -> float:
    """Scale a of the model ``cos^k(a gamma)``, which approximates ``cos^n gamma``.

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
        If the exponent is not finite and positive, the power or the rule is unknown, or the exponent is under
        1/2 for equal integrals with k = 4. The lobe would then be wider than the sphere.

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

    # The import takes half a second, and only one model needs a root.
    from scipy.optimize import brentq

    # At a = 1/2 the lobe covers the sphere; far out it falls like 0.6/a^2 at most.
    return float(brentq(excess, 0.5, 1 + math.sqrt(exponent + 1), xtol=1e-15, rtol=1e-14))


def _level_slope(exponent: float, level: float = 0.64) -> float:
    """Slope with which cosquad_q equals Blinn's power at a brightness; [C] finds 0.64 best."""
    return (math.sqrt(level) - 1) / math.expm1(math.log(level) / exponent)


PHONG = _MirrorPowerModel(
    "phong", "[T] 6, [B] 2", "(R.V)^n with the mirrored ray", lambda n: (n + 2) / (2 * math.pi)
)
"""Phong's model."""

BLINN = PowerModel(
    "blinn", "[B] 3", "(N.H)^n, exact", lambda n: (n + 2) * (n + 4) / (8 * math.pi * (2 ** (-n / 2) + n))
)
"""Blinn's model, which other models approximate."""

COSQUAD = PolynomialModel(
    "cosquad", "[T] 3.4, figure 3.6", "the thesis's cosine-quadratic: (1 - n/2 (1 - N.H))^2, or 0", a=1 / 2
)
"""The cosine-quadratic model f2."""

REFLECTION_MODELS: dict[str, ReflectionModel] = {
    model.name: model
    for model in (
        PHONG,
        BLINN,
        COSQUAD,
        PolynomialModel("cosquad7", "[T] figure 3.7", "cosquad with the slope 7/16 n", a=7 / 16),
        PolynomialModel(
            "cosquad_q",
            "[C]",
            "cosquad with the slope that meets Blinn's power exactly at one level",
            curve=_level_slope,
        ),
        PolynomialModel(
            "cosquad_lin",
            "[C]",
            "cosquad with a slope linear in n, as printed",
            lambda n: 0.214 * (0.807 + n),
            a=0.448,
            b=0.099,
        ),
        # A line through the slope of cosquad_q, in place of the line that [C] prints.
        PolynomialModel(
            "cosquad_lin_refitted",
            "own fit",
            "cosquad with a slope linear in n, fitted to cosquad_q",
            a=0.44813,
            b=0.10235,
        ),
        PolynomialModel("lyon2", "Lyon 1993", "Lyon's fourth power of a line in N.H", a=1 / 4, squarings=2),
        PolynomialModel("lyon3", "Lyon 1993", "Lyon's eighth power of a line in N.H", a=1 / 8, squarings=3),
        # Minimax over the whole range.
        PolynomialModel(
            "lyon1_refitted",
            "own fit",
            "a square of a line in N.H, fitted over all exponents",
            a=0.3557,
            b=0.2457,
        ),
        PolynomialModel(
            "lyon2_refitted",
            "own fit",
            "a fourth power of a line in N.H, fitted",
            a=0.2113,
            b=0.1468,
            squarings=2,
        ),
        PolynomialModel(
            "lyon3_refitted",
            "own fit",
            "an eighth power of a line in N.H, fitted",
            a=0.1150,
            b=0.0799,
            squarings=3,
        ),
        AngleCosine("coscos2", "[T] 3.1", "a squared cosine of a multiple of the angle"),
        AngleCosine("coscos4", "[T] 3.1", "a fourth power of a cosine of a multiple of the angle", power=4),
        AngleCosine(
            "coscos2_integral",
            "[T] 3.1",
            "coscos2 with the same integral as Blinn's power",
            rule="integral",
        ),
        AngleCosine(
            "coscos4_integral",
            "[T] 3.1",
            "coscos4 with the same integral as Blinn's power",
            power=4,
            rule="integral",
        ),
        Exponential("exp", "own", "exp(-n (1 - N.H)), the limit of Blinn's power"),
    )
}
"""Every reflection model, by name; the only place of their coefficients."""


def _registered(name: str) -> ReflectionModel:
    return REFLECTION_MODELS[name]


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
