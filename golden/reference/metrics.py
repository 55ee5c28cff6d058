"""Metrics: error figures of an image against a reference."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

__all__ = ["ErrorFigures", "error_figures", "error_map", "mnse_published", "nmse"]


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


# Number of values processed together; it limits the memory.
_CHUNK = 1 << 20


def _pair(image: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The image unchanged, and the reference in float64, so that their difference is in float64."""
    image = np.asarray(image)
    reference = np.asarray(reference, dtype=np.float64)
    if image.shape != reference.shape:
        raise ValueError(f"the images must have one shape, not {image.shape} and {reference.shape}")
    if not image.size:
        raise ValueError("the images must have at least one pixel")
    return image, reference


def _chunks(*arrays: np.ndarray) -> Iterator[list[np.ndarray]]:
    """The same parts of arrays of one shape, flat."""
    flat = [array.reshape(-1) for array in arrays]
    for start in range(0, len(flat[0]), _CHUNK):
        yield [array[start : start + _CHUNK] for array in flat]


def error_figures(
    image: np.ndarray, reference: np.ndarray, mask: np.ndarray | None = None, scale: float = 1
) -> ErrorFigures:
    """Largest, 99.9th percentile and root mean square error, and PSNR.

    Parameters
    ----------
    image, reference : arrays, shape (height, width) or (height, width, channels)
        Values in LSB, 0 to 255, of any type; a float64 reference stays unrounded.
    mask : bool array, shape (height, width), optional
        The pixels that count; all by default.
    scale : float
        LSB in one unit of the reference: 1, or 255 for a reference in [0, 1].

    Raises
    ------
    ValueError
        If the shapes differ or no pixel counts.
    """
    image, reference = _pair(image, reference)
    if mask is not None:
        mask = np.asarray(mask, dtype=bool)
        if mask.shape != image.shape[:2]:
            raise ValueError(f"the mask must have shape {image.shape[:2]}, not {mask.shape}")
        pixels = np.flatnonzero(mask)
        if not len(pixels):
            raise ValueError("the mask must hold at least one pixel")
        image, reference = (array.reshape(mask.size, -1)[pixels] for array in (image, reference))
    error, total, done = np.empty(image.size), 0.0, 0
    for shown, exact in _chunks(image, reference):
        part = np.multiply(exact, scale, out=error[done : done + len(exact)])
        part -= shown
        np.abs(part, out=part)
        total += float((part * part).sum())
        done += len(part)
    rmse = math.sqrt(total / error.size)
    return ErrorFigures(
        max_lsb=float(error.max()),
        p999_lsb=float(np.percentile(error, 99.9, overwrite_input=True)),
        rmse_lsb=rmse,
        psnr_db=20 * math.log10(255 / rmse) if rmse else math.inf,
    )


def error_map(image: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Largest absolute error of the channels of each pixel, in LSB.

    Parameters
    ----------
    image : uint8 array, shape (height, width, channels)
        The picture.
    reference : float64 array, same shape
        The exact picture, in [0, 1]; it is not rounded.

    Returns
    -------
    float64 array, shape (height, width)

    Raises
    ------
    ValueError
        If the shapes differ or there is no pixel.
    """
    image, reference = _pair(image, reference)
    error = np.zeros(image.shape[:2])
    for channel in range(image.shape[2]):  # one channel at a time: a third of the memory
        np.maximum(error, np.abs(image[..., channel] - 255 * reference[..., channel]), out=error)
    return error


def _deviations(image: np.ndarray, reference: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Parts of the difference of two images, and of the reference's deviation from its mean."""
    mean = reference.mean()
    # The mean is rounded, so a flat image is a few units in the last place away from its own mean.
    noise = 64 * np.finfo(np.float64).eps * max(abs(reference.max()), abs(reference.min()))
    for shown, exact in _chunks(image, reference):
        deviation = exact - mean
        deviation[np.abs(deviation) <= noise] = 0.0
        yield exact - shown, deviation


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
    error = spread = 0.0
    for difference, deviation in _deviations(image, reference):
        error += float((difference**2).sum())
        spread += float((deviation**2).sum())
    if error == 0:
        return 0.0
    return error / spread if spread else math.inf


def mnse_published(image: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
    """MNSE as [T] 4.1 prints it: ``(1/N) sum (I_i-O_i)^2 / (I_i-mean(I))^2``, where it is defined.

    Parameters
    ----------
    image, reference : arrays of one shape
        Values in the same unit. I is the reference, O the image.

    Returns
    -------
    value : float
        The mean of the N terms whose reference value differs from the mean of the reference; NaN if N is 0.
    share : float
        Share of these values among all values, 0 to 1.

    Raises
    ------
    ValueError
        If the shapes differ or there is no pixel.
    """
    image, reference = _pair(image, reference)
    total, count = 0.0, 0
    for difference, deviation in _deviations(image, reference):
        defined = deviation != 0
        ratio = difference[defined] / deviation[defined]
        total += float((ratio * ratio).sum())
        count += len(ratio)
    return (total / count if count else math.nan), count / image.size
