"""Colours of vertices in mesh files."""

import numpy as np

from blysk.golden.reference.transfer import decode
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused

__all__ = ["vertex_colors"]

# Rounding may put a number above full light by this part of full light.
_ROUNDED = 1e-6


def vertex_colors(channels: np.ndarray, whole: float | None = None) -> np.ndarray:
    """Colours in linear light, from channels encoded by the curve of sRGB.

    Parameters
    ----------
    channels : array
        Numbers of a file, of all channels or of one.
    whole : float, optional
        The number that stands for full light. By default 255 if all numbers are whole and a number is over 1,
        else 1.

    Returns
    -------
    float64 array, same shape

    Raises
    ------
    Refused
        If a number is NaN, negative or over full light.
    """
    channels = np.asarray(channels, dtype=np.float64)
    if whole is None:
        coded = (channels == np.floor(channels)).all() and channels.max(initial=0) > 1
        whole = 255.0 if coded else 1.0
    wrong = ~((channels >= 0) & (channels <= whole * (1 + _ROUNDED)))
    if wrong.any():
        raise Refused(
            f"a vertex has {channels[wrong][0]:g} in its colour, not a number from 0 to {whole:g}",
            ONE_MATERIAL,
        )
    return decode(channels / whole)
