"""Lobes of N·H that only a table serves: microfacets, coplanar Phong, and any curve; in float64."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from blysk.golden.reference.reflection import BLINN, ReflectionModel
from blysk.golden.text import plain_text

__all__ = [
    "BECKMANN",
    "COPLANAR_PHONG",
    "GGX",
    "LEAST_ROUGHNESS",
    "MAX_POINTS",
    "STEEPEST",
    "TABLE_MODELS",
    "Beckmann",
    "CoplanarPhong",
    "MicrofacetModel",
    "TabulatedModel",
    "TrowbridgeReitz",
    "checked_roughness",
    "curve_lines",
    "exponent_of_roughness",
    "roughness_of_exponent",
]


MAX_POINTS = 100_000
"""Largest number of points of a curve in a file."""

LEAST_ROUGHNESS = 0.05
"""Least roughness of a mesh file's material; below it the error of one step of u's word is visible."""

STEEPEST = 10_000.0
"""Largest steepness of a curve, and steepness of a curve that jumps."""


@dataclass(frozen=True, repr=False)
class CoplanarPhong(ReflectionModel):
    """``max(2 c^2 - 1, 0)^p``: Phong's model with exponent p as a lobe of c = N·H, for coplanar vectors.

    Where N, L and V are coplanar, the angle between R and V is twice the angle between N and H. Then
    ``R·V = 2 c^2 - 1``, and this is Phong's model. Near its peak this is Blinn's model with an exponent of 4
    p (`exponent_ratio`).

    Elsewhere R·V is no function of N·H, and this model differs from Phong's. In grazing light the highlight
    of this model is stretched, as with Blinn's model. With Phong's model it stays round.

    Source: docs/theory/models.md#reflection-models; [P].
    """

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        # 2 c^2 - 1 = 1 - 2 (1 - c)(1 + c), in which a small 1 - c keeps its digits.
        base = 1 - 2 * (1 - cosine) * (1 + cosine)
        return np.where(cosine > 0, np.maximum(base, 0.0), 0.0) ** exponent

    def steepness(self, parameter: float | None) -> float:
        """Four times the exponent, at the peak."""
        return 4 * self._checked(parameter)


@dataclass(frozen=True, repr=False)
class MicrofacetModel(ReflectionModel):
    """A distribution D of the normals of microfacets, divided by its largest value: ``S = D / peak``.

    The parameter is the roughness r of glTF, greater than 0 and at most 1. The formulas have ``alpha = r^2``.
    ``integral D(c) c = 1`` over the hemisphere, with c = N·H, and D is 0 for c <= 0. S has no other factor of
    a microfacet model (Fresnel, masking and shadowing).

    The energy factor is 1 divided by ``integral S(cos(t/2)) cos t`` over the hemisphere, with the viewer
    along the normal, as for ``blinn``. With ``w = c^2`` the integral is
    ``4 pi integral_{1/2}^1 S (2 w - 1) dw``.

    Source: docs/theory/models.md#reflection-models; B. Walter and others, *Microfacet models for refraction
    through rough surfaces*, 2007; glTF 2.0, appendix B.
    """

    PARAMETER: ClassVar = "roughness"

    def _checked(self, parameter: float | None) -> float:
        if parameter is None:
            raise ValueError("roughness must be given")
        return checked_roughness(parameter)

    def steepness(self, parameter: float | None) -> float:
        """Steepness of the curve itself, see `ReflectionModel.steepness`."""
        return _steepness(self, parameter)

    def peak(self, roughness: float) -> float:
        """Largest value of D: ``1 / (pi alpha^2)``, its value at c = 1, unless the subclass says otherwise.

        Raises
        ------
        ValueError
            If the roughness is not greater than 0 and at most 1.
        """
        return self._peak(_alpha(checked_roughness(roughness)))

    def _peak(self, alpha: float) -> float:
        return 1 / (math.pi * alpha * alpha)


@dataclass(frozen=True, repr=False)
class TrowbridgeReitz(MicrofacetModel):
    """GGX: ``D = alpha^2 / (pi (c^2 (alpha^2 - 1) + 1)^2)``, largest at c = 1.

    In ``u = 1 - c`` it is ``S = 1 / (1 + u (2 - u) (1 - alpha^2) / alpha^2)^2``. Its tail is long: S falls to
    alpha^4 at a right angle.

    Source: docs/theory/models.md#reflection-models; T. Trowbridge and K. Reitz, *Average irregularity
    representation of a rough surface for ray reflection*, 1975.
    """

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        alpha = _alpha(exponent)
        spread = (1 - cosine) * (1 + cosine) * ((1 - alpha) * (1 + alpha) / alpha**2)
        return np.where(cosine > 0, (1 + np.maximum(spread, 0.0)) ** -2.0, 0.0)


@dataclass(frozen=True, repr=False)
class Beckmann(MicrofacetModel):
    """Beckmann: ``D = exp(-tan^2 gamma / alpha^2) / (pi alpha^2 c^4)``, with ``c = cos gamma``.

    Up to ``alpha = 1/sqrt 2`` (roughness 0.84) D is largest at c = 1, and falls with c. For a larger alpha D
    is largest at ``c^2 = 1/(2 alpha^2)``, where it is ``4 alpha^2 exp(1/alpha^2 - 2) / pi``, up to 1.47 times
    its value at c = 1.

    Source: docs/theory/models.md#reflection-models; P. Beckmann and A. Spizzichino, *The scattering of
    electromagnetic waves from rough surfaces*, 1963; R. Cook and K. Torrance, *A reflectance model for
    computer graphics*, 1982.
    """

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        alpha = _alpha(exponent)
        # Below the limit the exponential is 0: tan^2 / alpha^2 is nearly 800.
        square = np.maximum(cosine * cosine, 1 / (1 + 800 * alpha**2))
        tangent = (1 - cosine) * (1 + cosine) / square
        density = np.exp(-tangent / alpha**2) / (math.pi * (alpha * square) ** 2)
        return np.where(cosine > 0, density / self._peak(alpha), 0.0)

    def _peak(self, alpha: float) -> float:
        if 2 * alpha * alpha <= 1:
            return super()._peak(alpha)
        return 4 * alpha * alpha * math.exp(alpha**-2 - 2) / math.pi


@dataclass(frozen=True, repr=False)
class TabulatedModel(ReflectionModel):
    """Any curve of N·H: a function, or straight lines between given points (`of_points`).

    It has no parameter. Where N·H is not positive the brightness is 0.

    Parameters
    ----------
    function : callable
        The curve: it takes a float64 array of cosines, greater than 0 and at most 1, and returns as many
        values from 0 to 1.

    Raises
    ------
    ValueError
        On use, if the function gives an array of another shape, or a value that is not 0 to 1.
    """

    function: Callable[[np.ndarray], np.ndarray] | None = None

    PARAMETER: ClassVar = None

    @classmethod
    def of_points(
        cls, name: str, cosines: np.ndarray, values: np.ndarray, source: str = ""
    ) -> "TabulatedModel":
        """Model of straight lines between points.

        Parameters
        ----------
        name, source : str
            Name and source of the model.
        cosines : array, shape (points,)
            N·H, rising from 0 to 1.
        values : array, shape (points,)
            Brightness at each cosine, 0 to 1.

        Raises
        ------
        ValueError
            If there are fewer than two points, or the cosines do not go from 0 to 1. If a number is not
            finite, a value is not 0 to 1, or a cosine is not larger than the cosine before. The message names
            the first wrong point, counted from 1.
        """
        cosines, values = (np.array(column, dtype=np.float64) for column in (cosines, values))
        if cosines.ndim != 1 or cosines.shape != values.shape:
            raise ValueError(f"{name} must have one value for each cosine, and one row of each")
        if len(cosines) < 2:
            raise ValueError(f"{name} must have at least 2 points, not {len(cosines)}")
        for good, must in (
            (np.isfinite(cosines) & np.isfinite(values), "have two finite numbers"),
            ((values >= 0) & (values <= 1), "have a value from 0 to 1"),
            (np.diff(cosines, prepend=-np.inf) > 0, "have a larger cosine than the point before it"),
        ):
            if not good.all():
                bad = int(np.argmin(good))
                given = f"cosine {cosines[bad]:.6g}, value {values[bad]:.6g}"
                raise ValueError(f"point {bad + 1} of {name} must {must}, not {given}")
        if cosines[0] != 0 or cosines[-1] != 1:
            raise ValueError(
                f"the cosines of {name} must go from 0 to 1, not from {cosines[0]:.6g} to {cosines[-1]:.6g}"
            )
        lines = partial(np.interp, xp=cosines, fp=values)
        return cls(name, source, function=lines)  # type: ignore[arg-type]

    @classmethod
    def of_csv(cls, path: str | Path) -> "TabulatedModel":
        """Model of straight lines between the points of a CSV file; it has the name of the file.

        A line holds a cosine, a comma, and a value. Lines that are empty or begin with ``#`` are ignored, and
        so is the first other line if it holds no number.

        Parameters
        ----------
        path : str or Path
            File with at most `MAX_POINTS` points.

        Raises
        ------
        ValueError
            If the file is no text or has too many points, or a line does not hold two numbers; and as for
            `of_points`. The message names the file, and the line or the point.
        OSError
            If the file cannot be read.
        """
        path = Path(path)
        try:
            text = plain_text(path.read_bytes())
        except UnicodeDecodeError:
            raise ValueError(f"{path.name} must be a text of numbers, not other bytes") from None
        lines = [
            (number, [field.strip() for field in line.split(",")])
            for number, line in enumerate(text.split("\n"), 1)
            if line.strip() and not line.lstrip().startswith("#")
        ]
        if len(lines) > MAX_POINTS:
            raise ValueError(f"{path.name} must have at most {MAX_POINTS:,} points, not {len(lines):,}")
        if lines and not any(map(_is_number, lines[0][1])):
            del lines[0]
        for number, fields in lines:
            if len(fields) != 2 or not all(map(_is_number, fields)):
                shown = ",".join(fields)[:40]
                raise ValueError(f"line {number} of {path.name} must have two numbers, not {shown!r}")
        points = np.array([fields for _, fields in lines], dtype=np.float64).reshape(-1, 2)
        return cls.of_points(path.stem, points[:, 0], points[:, 1], path.name)

    def _checked(self, parameter: float | None) -> float:
        return 0.0

    def steepness(self, parameter: float | None = None) -> float:
        """Steepness of the curve itself, see `ReflectionModel.steepness`."""
        return _steepness(self, parameter)

    def reflect(self, cosine: npt.ArrayLike, parameter: float | None = None) -> np.ndarray:
        """Brightness S, see `ReflectionModel.reflect`; a parameter is ignored."""
        return super().reflect(cosine, parameter)

    def _lobe(self, cosine: np.ndarray, exponent: float) -> np.ndarray:
        lit = cosine > 0
        assert self.function is not None
        given = np.asarray(self.function(cosine[lit]), dtype=np.float64)
        if given.shape != cosine[lit].shape:
            raise ValueError(f"{self.name} must give one value for each cosine")
        if not ((given >= 0) & (given <= 1)).all():
            raise ValueError(f"{self.name} must give values from 0 to 1")
        value = np.zeros(cosine.shape)
        value[lit] = given
        return value


def _steepness(model: ReflectionModel, parameter: float | None) -> float:
    """Steepest slope of the lines of `curve_lines`, from 1 to `STEEPEST`."""
    return float(np.clip(curve_lines(model, parameter)[2].max(), 1.0, STEEPEST))


def curve_lines(model: ReflectionModel, parameter: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A curve S(u), u = 1 - N·H, as 4,000 straight lines, which are shorter towards the peak.

    Parameters
    ----------
    model : ReflectionModel
        Model of N·H.
    parameter : float or None
        Exponent or roughness, as `ReflectionModel.PARAMETER` says.

    Returns
    -------
    u, value, slope : float64 arrays, shape (4000,)
        Start of each line, S at the start, and ``|dS/du|`` of the line.
    """
    u = np.r_[0, np.geomspace(1e-7, 1 - 1e-12, 4_000)]
    value = model.reflect(1 - u, parameter)
    return u[:-1], value[:-1], np.abs(np.diff(value)) / np.diff(u)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def checked_roughness(roughness: float) -> float:
    """The roughness as a float.

    Raises
    ------
    ValueError
        If it is not greater than 0 and at most 1.
    """
    roughness = float(roughness)
    if not 0 < roughness <= 1:
        raise ValueError(f"roughness must be greater than 0 and at most 1, not {roughness}")
    return roughness


def _alpha(roughness: float) -> float:
    """``roughness^2``, large enough that its powers are numbers.

    The lobes are then 0 except at N·H = 1, as for any smaller roughness. The next cosine gives 1e-100.
    """
    return max(roughness, 2.0**-96) ** 2


def _energy_of_ggx(roughness: float) -> float:
    """Factor ``1 / (4 pi I)`` with ``I = (z - ln(1 + z)) / (2 z^2)``, ``z = (1 - alpha^2) / (2 alpha^2)``."""
    alpha = _alpha(roughness)
    z = (1 - alpha) * (1 + alpha) / (2 * alpha * alpha)
    # Near z = 0 the difference has lost its digits. The series is off by less than z^3 / 10.
    integral = (z - math.log1p(z)) / (2 * z * z) if z > 1e-4 else 0.25 - z / 6 + z * z / 8
    return 1 / (4 * math.pi * integral)


def _energy_of_beckmann(roughness: float) -> float:
    """Energy factor: 1 over the integral of S, which is the integral of D divided by its peak.

    With ``t = 1/w - 1`` and ``D = exp(-t/alpha^2) / (pi alpha^2 w^2)`` the integral of D is
    ``4 / alpha^2 integral_0^1 exp(-t/alpha^2) (2/(1 + t) - 1) dt``. The part with t over 40 alpha^2 is under
    e^-40.
    """
    alpha = _alpha(roughness)
    half = min(1.0, 40 * alpha * alpha) / 2
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t = (nodes + 1) * half
    integral = half * float(weights @ (np.exp(-t / alpha**2) * (2 / (1 + t) - 1)))
    return BECKMANN.peak(roughness) * alpha * alpha / (4 * integral)


COPLANAR_PHONG = CoplanarPhong(
    "phong_coplanar", "[T] 6, [P]", "Phong's (R.V)^n where all vectors lie in a plane"
)
"""Phong's model where N, L and V are coplanar."""

BECKMANN = Beckmann("beckmann", "Beckmann 1963", "Beckmann's lobe, by roughness", _energy_of_beckmann)
"""Beckmann's distribution."""

GGX = TrowbridgeReitz("ggx", "Trowbridge 1975, Walter 2007", "the lobe of glTF, by roughness", _energy_of_ggx)
"""The distribution of Trowbridge and Reitz."""

TABLE_MODELS: dict[str, ReflectionModel] = {
    model.name: model for model in (BLINN, COPLANAR_PHONG, BECKMANN, GGX)
}
"""Models of which a frame may load a table, by name."""


def exponent_of_roughness(roughness: float) -> float:
    """Exponent of Blinn's model for a roughness: ``n = 2 / alpha^2 - 2`` with ``alpha = roughness^2``.

    With it Blinn's power near the peak is ``exp(-gamma^2 / alpha^2)``, up to a factor ``1 + O(gamma^2)``,
    like Beckmann's distribution. At roughness 1 the result is 0, which is not a valid exponent.

    Raises
    ------
    ValueError
        If the roughness is not greater than 0 and at most 1.

    Notes
    -----
    Source: docs/theory/models.md#reflection-models; Walter 2007.
    """
    return 2 / _alpha(checked_roughness(roughness)) ** 2 - 2


def roughness_of_exponent(exponent: float) -> float:
    """Roughness for an exponent n of Blinn's model, ``(2 / (n + 2))^(1/4)``: inverse `exponent_of_roughness`.

    Raises
    ------
    ValueError
        If the exponent is not finite and positive.

    Notes
    -----
    Source: docs/theory/models.md#reflection-models; Walter 2007.
    """
    if not (math.isfinite(exponent) and exponent > 0):
        raise ValueError(f"exponent must be finite and greater than 0, not {exponent}")
    found: float = (2 / (exponent + 2)) ** 0.25
    return found
