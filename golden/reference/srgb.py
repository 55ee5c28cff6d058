"""The curve of sRGB, in float64."""

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["linear_of_srgb"]


def linear_of_srgb(values: ArrayLike) -> np.ndarray:
    """Linear light of values by the curve of sRGB.

    ``v / 12.92`` up to 0.04045, else ``((v + 0.055) / 1.055)^2.4``.

    Parameters
    ----------
    values : array
        Codes over their largest code, 0 to 1.

    Returns
    -------
    float64 array, same shape
        0 to 1; 0 and 1 stay.

    Source: IEC 61966-2-1.
    """
    values = np.asarray(values, dtype=np.float64)
    found: np.ndarray = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return found
