"""Minimax polynomial fits, with some coefficients given, or with coefficients in a hardware format.

Source: docs/theory/interpolation.md#bisection.
"""

from collections.abc import Callable, Mapping

import numpy as np

from blysk.golden.number.fixed import Format

__all__ = ["half_angle_factor", "largest_error", "minimax", "minimax_quantised", "reciprocal_root"]

GRID = 4001
"""Number of points of a domain on which a fit is found and its error measured."""


def half_angle_factor(u: np.ndarray) -> np.ndarray:
    """Factor ``h = 1/sqrt(2 (1 + r))``, ``u = 1 - r``: the middle normal is ``h (N_l + N_r)`` ([T] 2.2).

    Parameters
    ----------
    u : array
        One minus the cosine of the span angle, below 2.
    """
    return 1 / np.sqrt(2 * (2 - np.asarray(u, dtype=np.float64)))


def reciprocal_root(z: np.ndarray) -> np.ndarray:
    """Factor ``1/sqrt(2 + z)`` of the bisection unit, ``z = 2 N_a . N_b`` ([T] 2.1)."""
    return 1 / np.sqrt(2 + np.asarray(z, dtype=np.float64))


def _grid(low: float, high: float) -> np.ndarray:
    # Chebyshev spacing: the error of a minimax fit changes fastest at the ends.
    return low + (high - low) * (1 - np.cos(np.linspace(0, np.pi, GRID))) / 2


def minimax(
    function: Callable[[np.ndarray], np.ndarray],
    low: float,
    high: float,
    degree: int,
    held: Mapping[int, float] | None = None,
) -> np.ndarray:
    """Coefficients, in ascending order, of the polynomial of least maximum error.

    Solved as a linear programme: minimise e subject to ``|function(x) - p(x)| <= e`` on a grid.

    Parameters
    ----------
    function : callable
        Function to fit, vectorised.
    low, high : float
        Domain.
    degree : int
        Degree of the polynomial.
    held : mapping of int to float, optional
        Coefficients that are given, by power; ``{0: function(0)}`` makes the fit exact at 0.

    Returns
    -------
    float64 array, shape (degree + 1,)
        Coefficients.
    """
    held = dict(held or {})
    x = _grid(low, high)
    powers = np.vander(x, degree + 1, increasing=True)
    free = [power for power in range(degree + 1) if power not in held]
    coefficients = np.zeros(degree + 1)
    coefficients[list(held)] = list(held.values())
    target = function(x) - powers @ coefficients
    # The programme is solved in units of the residual's size, to stay above the solver's tolerance.
    unit = np.abs(target).max() or 1.0
    # On a narrow domain far from 0 the powers are nearly parallel, and a fit in them is poor.
    basis, triangle = np.linalg.qr(powers[:, free])
    matrix = basis * np.sqrt(GRID)
    ones = np.ones((len(x), 1))
    # The import takes half a second, and most programs need no fit.
    from scipy.optimize import linprog

    tighter = 1.0
    for _ in range(2):
        fit = linprog(
            np.r_[np.zeros(len(free)), 1.0],
            A_ub=np.block([[matrix, -ones], [-matrix, -ones]]),
            b_ub=np.r_[target, -target] / (unit * tighter),
            bounds=[(None, None)] * (len(free) + 1),
            method="highs",
        )
        step = np.linalg.solve(triangle, fit.x[:-1] * unit * tighter * np.sqrt(GRID))
        coefficients[free] += step
        target = target - powers[:, free] @ step
        tighter = np.abs(target).max() / unit or 1.0
    return coefficients


def minimax_quantised(
    function: Callable[[np.ndarray], np.ndarray],
    low: float,
    high: float,
    formats: Mapping[int, Format],
    held: Mapping[int, float] | None = None,
) -> np.ndarray:
    """Minimax coefficients in hardware formats, rounded and fitted again one after the other.

    Each coefficient, lowest power first, is rounded to its format and held. The others are fitted again, and
    compensate most of its rounding error.

    Parameters
    ----------
    function, low, high, held
        As for `minimax`.
    formats : mapping of int to Format
        Number format of the coefficient of each power.

    Returns
    -------
    int64 array
        Codes of the coefficients in ``formats``, in ascending order of the power.
    """
    held = dict(held or {})
    degree = max(formats)
    codes = []
    for power in sorted(formats):
        format = formats[power]
        code = int(np.floor(minimax(function, low, high, degree, held)[power] / format.step + 0.5))
        held[power] = code * format.step
        codes.append(code)
    return np.array(codes, dtype=np.int64)


def largest_error(
    function: Callable[[np.ndarray], np.ndarray], coefficients: np.ndarray, low: float, high: float
) -> tuple[float, float]:
    """Largest absolute and largest relative error of a polynomial on a domain."""
    x = _grid(low, high)
    exact = function(x)
    error = np.abs(np.polynomial.polynomial.polyval(x, coefficients) - exact)
    return float(error.max()), float((error / np.abs(exact)).max())
