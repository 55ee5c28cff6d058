"""Perceived difference of two pictures: FLIP, CIEDE2000, and whether both look identical."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

__all__ = [
    "CIEDE2000_MAX",
    "CIEDE2000_P99",
    "FLIP_MAX",
    "FLIP_P99",
    "LARGEST_LSB",
    "Perceived",
    "identical_to_the_eye",
    "perceived",
]

LARGEST_LSB = 1.0
"""Largest error of a channel, in LSB, that counts as invisible for all values of the other figures."""

FLIP_P99 = 0.05
FLIP_MAX = 0.10
CIEDE2000_P99 = 1.0
CIEDE2000_MAX = 2.3
"""Limits of the verdict for an error over `LARGEST_LSB`.

An eye just notices a colour difference of about 2.3.
"""


@dataclass(frozen=True)
class Perceived:
    """Perceived differences of two pictures, over the pixels that count.

    Parameters
    ----------
    flip_p99, flip_max : float
        99th percentile (linear between neighbours) and largest value of the FLIP map, 0 to 1.
    ciede2000_p99, ciede2000_max : float
        99th percentile and largest value of the pixels' CIEDE2000 colour difference.
    """

    flip_p99: float
    flip_max: float
    ciede2000_p99: float
    ciede2000_max: float


def _flip() -> ModuleType:
    try:
        import flip_evaluator
    except ImportError:
        raise InputError("FLIP", "flip-evaluator is not installed", install_extra("report")) from None
    return flip_evaluator


def _color() -> ModuleType:
    try:
        from skimage import color
    except ImportError:
        raise InputError("CIEDE2000", "scikit-image is not installed", install_extra("report")) from None
    return color


def perceived(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> Perceived:
    """FLIP and CIEDE2000 between two pictures.

    Channels are codes of sRGB. FLIP (Andersson and others 2020, LDR) is for a viewer who sees 67 pixels a
    degree, the default of FLIP. The FLIP value of a pixel depends on its neighbours, pixels of the background
    among them. CIEDE2000 is of each pixel alone, under D65 for the 2 degree observer. Only pixels of the mask
    count, because the background would make both figures too small.

    Parameters
    ----------
    image, reference : arrays, shape (height, width, 3)
        Values in LSB, 0 to 255, of any type. A float64 reference stays unrounded.
    mask : bool array, shape (height, width)
        The pixels that count, at least one.

    Raises
    ------
    ValueError
        If the shapes differ, a value is out of range or no pixel counts.
    InputError
        If a library is not installed.
    """
    if image.shape != reference.shape or image.shape != (*mask.shape, 3):
        raise ValueError(f"pictures of {image.shape} and {reference.shape}, a mask of {mask.shape}")
    if not mask.any():
        raise ValueError("the mask must hold at least one pixel")
    if not all(0 <= picture.min() <= picture.max() <= 255 for picture in (image, reference)):
        raise ValueError("values must be 0 to 255")
    shown, exact = (np.asarray(picture, dtype=np.float64) / 255 for picture in (image, reference))
    flip, _, _ = _flip().evaluate(
        exact.astype(np.float32), shown.astype(np.float32), "LDR", applyMagma=False, computeMeanError=False
    )
    flip = flip[..., 0][mask]
    color = _color()
    difference = color.deltaE_ciede2000(color.rgb2lab(exact[mask]), color.rgb2lab(shown[mask]))
    return Perceived(
        float(np.percentile(flip, 99)),
        float(flip.max()),
        float(np.percentile(difference, 99)),
        float(difference.max()),
    )


def identical_to_the_eye(largest_lsb: float, difference: Perceived) -> bool:
    """Whether two pictures look the same.

    They look the same if no channel's error is over `LARGEST_LSB`. Else FLIP must be at most `FLIP_P99` in 99
    % of the pixels, and at most `FLIP_MAX` in all. CIEDE2000 must be at most `CIEDE2000_P99` in 99 % of the
    pixels, and at most `CIEDE2000_MAX` in all.

    Parameters
    ----------
    largest_lsb : float
        Largest error of a channel, as in `ErrorFigures.max_lsb`; in codes of sRGB.
    difference : Perceived
        Perceived differences.
    """
    return largest_lsb <= LARGEST_LSB or (
        difference.flip_p99 <= FLIP_P99
        and difference.flip_max <= FLIP_MAX
        and difference.ciede2000_p99 <= CIEDE2000_P99
        and difference.ciede2000_max <= CIEDE2000_MAX
    )
