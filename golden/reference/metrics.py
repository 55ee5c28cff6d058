"""How far one image is from another."""

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["ErrorFigures", "error_figures", "mnse_published", "nmse"]


@dataclass(frozen=True)
class ErrorFigures:
    """Errors of an image in LSB, steps of an 8-bit channel.

    Parameters
    ----------
    max_lsb : float
        Largest absolute error of a channel.
    p999_lsb : float
        99.9th percentile of the absolute errors, linear between neighbours.
    rmse_lsb : float
        Root of the mean squared error.
    psnr_db : float
        ``20 log10(255 / rmse)``; infinite for equal images.
    """

    max_lsb: float
    p999_lsb: float
    rmse_lsb: float
    psnr_db: float


def _pair(image: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    image = np.asarray(image, dtype=np.float64)
    reference = np.asarray(reference, dtype=np.float64)
    if image.shape != reference.shape:
        raise ValueError(f"the images must have one shape, not {image.shape} and {reference.shape}")
    if not image.size:
        raise ValueError("the images must have at least one pixel")
    return image, reference


def error_figures(image: np.ndarray, reference: np.ndarray, mask: np.ndarray | None = None) -> ErrorFigures:
    """Largest, 99.9th percentile and root mean square error, and PSNR.

    Parameters
    ----------
    image, reference : arrays, shape (height, width) or (height, width, channels)
        Values in LSB, 0 to 255, of any type; a float64 reference stays unrounded.
    mask : bool array, shape (height, width), optional
        The pixels that count; all by default.

    Raises
    ------
    ValueError
        If the shapes differ or no pixel counts.
    """
    image, reference = _pair(image, reference)
    error = np.abs(image - reference)
    if mask is not None:
        mask = np.asarray(mask, dtype=bool)
        if mask.shape != error.shape[:2]:
            raise ValueError(f"the mask must have shape {error.shape[:2]}, not {mask.shape}")
        error = error[mask]
        if not error.size:
            raise ValueError("the mask must hold at least one pixel")
    rmse = math.sqrt(np.mean(error * error))
    return ErrorFigures(
        max_lsb=float(error.max()),
        p999_lsb=float(np.percentile(error, 99.9)),
        rmse_lsb=rmse,
        psnr_db=20 * math.log10(255 / rmse) if rmse else math.inf,
    )


def _deviation(reference: np.ndarray) -> np.ndarray:
    deviation = reference - reference.mean()
    # The mean is rounded, so a flat image is a few units in the last place away from its own mean.
    noise = 64 * np.finfo(np.float64).eps * np.abs(reference).max()
    deviation[np.abs(deviation) <= noise] = 0.0
    return deviation


def nmse(image: np.ndarray, reference: np.ndarray) -> float:
    """Normalised mean squared error ``sum (I-O)^2 / sum (I-mean(I))^2``, I the reference, O the image.

    Parameters
    ----------
    image, reference : arrays of one shape
        Values in any one unit.

    Returns
    -------
    float
        0 for equal images; infinite when the reference is flat and the image differs from it.

    Raises
    ------
    ValueError
        If the shapes differ or there is no pixel.
    """
    image, reference = _pair(image, reference)
    error = float(((reference - image) ** 2).sum())
    spread = float((_deviation(reference) ** 2).sum())
    if error == 0:
        return 0.0
    return error / spread if spread else math.inf


def mnse_published(image: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
    """MNSE as [T] 4.1 prints it: ``(1/N) sum (I_i-O_i)^2 / (I_i-mean(I))^2``, where it is defined.

    Parameters
    ----------
    image, reference : arrays of one shape
        Values in any one unit; I is the reference, O the image.

    Returns
    -------
    value : float
        The mean over the N values of the reference that differ from its mean; NaN when there is none.
    share : float
        The share of those values, 0 to 1.

    Raises
    ------
    ValueError
        If the shapes differ or there is no pixel.
    """
    image, reference = _pair(image, reference)
    deviation = _deviation(reference)
    defined = deviation != 0
    if not defined.any():
        return math.nan, 0.0
    ratio = (reference - image)[defined] / deviation[defined]
    return float(np.mean(ratio * ratio)), float(defined.mean())
