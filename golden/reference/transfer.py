"""Output transfer in float64: from linear light to the values that the codes of a picture stand for."""

import re

import numpy as np
import numpy.typing as npt

from blysk.golden.text import numbers_of_text

__all__ = [
    "LARGEST_SLOPE",
    "SPACES",
    "TRANSFERS",
    "color_of_text",
    "decode",
    "encode",
    "encode_frame",
    "slope",
]

SPACES = {"srgb": "sRGB", "linear": "linear light"}
"""For each output transfer the name of the space of its codes, for texts."""

TRANSFERS = tuple(SPACES)
"""Output transfers: the curve of sRGB, or light as it is."""

LARGEST_SLOPE = 12.92
"""Slope of the curve of sRGB at black, its largest."""

_LAST_LINEAR, _LAST_LINEAR_ENCODED = 0.0031308, 0.04045
_SCALE, _OFFSET, _EXPONENT = 1.055, 0.055, 2.4


def encode(light: npt.ArrayLike, transfer: str = "srgb") -> np.ndarray:
    """Encoded values of linear light.

    For ``srgb``, up to 0.0031308 the value is ``12.92 x``, and above ``1.055 x^(1/2.4) - 0.055``. It rises
    from 0 to 1, and its slope falls.

    Parameters
    ----------
    light : float array, any shape
        Linear light; 1 is the full channel. Values outside [0, 1] are limited to this range.
    transfer : str
        One of `TRANSFERS`.

    Returns
    -------
    float64 array, same shape
        In [0, 1]; times 255, codes of a picture before rounding.

    Raises
    ------
    ValueError
        If the transfer is unknown.

    Source: docs/theory/textures.md#transfer; IEC 61966-2-1.
    """
    light = np.clip(np.asarray(light, dtype=np.float64), 0, 1)
    if _is_linear(transfer):
        return light
    power = light ** (1 / _EXPONENT)
    # The result at 1 is exactly 1, because the offset is the scale minus 1.
    curve = power + _OFFSET * (power - 1)
    found: np.ndarray = np.where(light <= _LAST_LINEAR, LARGEST_SLOPE * light, curve)
    return found


def encode_frame(frame: np.ndarray, transfer: str) -> np.ndarray:
    """`encode` in place, row by row, as a large frame has 400 MB.

    Parameters
    ----------
    frame : float64 array, shape (height, width, 3)
        Linear light in [0, 1], which is overwritten.
    transfer : str
        One of `TRANSFERS`.

    Returns
    -------
    float64 array
        ``frame``.
    """
    if not _is_linear(transfer):
        for row in frame:
            row[...] = encode(row, transfer)
    return frame


def decode(encoded: npt.ArrayLike, transfer: str = "srgb") -> np.ndarray:
    """Linear light of encoded values, the inverse of `encode`.

    Parameters
    ----------
    encoded : float array, any shape
        Codes of a picture divided by 255. Values outside [0, 1] are limited to this range.
    transfer : str
        One of `TRANSFERS`.

    Returns
    -------
    float64 array, same shape
        In [0, 1]; 1 is the full channel.

    Raises
    ------
    ValueError
        If the transfer is unknown.

    Source: docs/theory/textures.md#transfer; IEC 61966-2-1.
    """
    encoded = np.clip(np.asarray(encoded, dtype=np.float64), 0, 1)
    if _is_linear(transfer):
        return encoded
    curve = ((encoded + _OFFSET) / _SCALE) ** _EXPONENT
    found: np.ndarray = np.where(encoded <= _LAST_LINEAR_ENCODED, encoded / LARGEST_SLOPE, curve)
    return found


def slope(least: npt.ArrayLike, transfer: str = "srgb") -> np.ndarray:
    """Largest slope of `encode` over light of a value or more: 12.92 at black, 0.44 at full light.

    Parameters
    ----------
    least : float array, any shape
        The least linear light, 0 or more.
    transfer : str
        One of `TRANSFERS`.

    Returns
    -------
    float64 array, same shape

    Raises
    ------
    ValueError
        If the transfer is unknown.
    """
    least = np.clip(np.asarray(least, dtype=np.float64), 0, 1)
    if _is_linear(transfer):
        return np.ones_like(least)
    curve = _SCALE / _EXPONENT * np.maximum(least, _LAST_LINEAR) ** (1 / _EXPONENT - 1)
    found: np.ndarray = np.where(least <= _LAST_LINEAR, LARGEST_SLOPE, curve)
    return found


def _is_linear(transfer: str) -> bool:
    if transfer not in TRANSFERS:
        raise ValueError(f"transfer must be one of {', '.join(TRANSFERS)}, not {transfer!r}")
    return transfer == "linear"


def color_of_text(text: str) -> list[float]:
    """Read a colour: ``#rrggbb``, or numbers with commas; one number is all three channels.

    ``#rrggbb`` has codes of sRGB, which are decoded to linear light from 0 to 1. Numbers are linear light.

    Raises
    ------
    ValueError
        If the text is not a colour.
    """
    if re.fullmatch("#[0-9a-fA-F]{6}", text):
        codes: list[float] = decode(np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255).tolist()
        return codes
    numbers = numbers_of_text(text)
    return numbers * 3 if len(numbers) == 1 else numbers
