"""Bit-accurate model of the intensity units: the sum of ambient, diffuse and specular light of a pixel."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.number.fixed import UQ, Fixed, Format

__all__ = ["MAX_INTENSITY", "MAX_LIGHTS", "Intensity"]

MAX_INTENSITY = 8
"""Largest intensity of a term; 1 is the full channel."""

MAX_LIGHTS = 16
"""Largest number of lights."""


@dataclass(frozen=True)
class Intensity:
    """``I = k_a I_a + sum_i I_i (k_d D_i + k_s S_i)`` for each channel, rounded half up, and saturated.

    The products ``k I`` are inputs, *colour operands* in LSB of the 8-bit channel. Their format is
    ``UQ(11, 6)``, 17 bits for the multipliers. So a term may reach 2047.98 LSB, eight times the full channel.
    The sum is exact. Only the operands and the result are rounded: by 2^-7 LSB each times a term of at most
    1, and by 1/2 LSB, or with 6 fraction bits by 2^-7 LSB.

    Parameters
    ----------
    lights : int
        Number of lights, 0 to 16.
    has_specular : bool
        Whether there are specular terms. If not, their inputs must be 0.
    channels : int
        3 or 1. With 1 every channel takes the colour operands of red.
    fraction_bits : int
        Fraction bits of the result: 0 for the codes of a picture in linear light, 6 for a `Transfer` behind.

    Raises
    ------
    ValueError
        If the number of lights, channels or fraction bits is out of range.

    Source: docs/theory/units.md#intensity; [B] 4 and 5, [T] figure 4.10.
    """

    lights: int = 1
    has_specular: bool = True
    channels: int = 3
    fraction_bits: int = 0

    COLOR_FORMAT = UQ(11, 6)
    TERM_FORMAT = UQ(0, 17)

    def __post_init__(self) -> None:
        if not 0 <= self.lights <= MAX_LIGHTS:
            raise ValueError(f"lights must be 0 to {MAX_LIGHTS}, not {self.lights}")
        if self.channels not in (1, 3):
            raise ValueError(f"channels must be 1 or 3, not {self.channels}")
        if self.fraction_bits not in (0, 6):
            raise ValueError(f"fraction_bits must be 0 or 6, not {self.fraction_bits}")

    @property
    def result_format(self) -> Format:
        """Format of a channel, ``UQ(8, 0)`` or ``UQ(8, 6)``, in LSB of the 8-bit channel."""
        return UQ(8, self.fraction_bits)

    @classmethod
    def color(cls, intensity: np.ndarray) -> np.ndarray:
        """Codes of colour operands for intensities (1 is the full channel).

        Raises
        ------
        ValueError
            If an intensity is negative, not finite, or over 8.
        """
        intensity = np.asarray(intensity, dtype=np.float64)
        if not np.all((intensity >= 0) & (intensity <= MAX_INTENSITY)):
            raise ValueError(f"the intensity of a term must be 0 to {MAX_INTENSITY}")
        found: np.ndarray = Fixed.round(cls.COLOR_FORMAT, intensity * 255).codes
        return found

    def compute(
        self, ambient: Fixed, diffuse_color: Fixed, specular_color: Fixed, diffuse: Fixed, specular: Fixed
    ) -> np.ndarray:
        """Bit-accurate channels.

        Parameters
        ----------
        ambient : Fixed, shape (3,), UQ(11, 6)
            Ambient colour operand.
        diffuse_color, specular_color : Fixed, shape (lights, 3), UQ(11, 6)
            Colour operands of each light.
        diffuse, specular : Fixed, shape (pixels, lights), UQ(0, 17)
            Terms of each light.

        Returns
        -------
        uint8 or uint16 array, shape (pixels, 3)
            Codes of `result_format`.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        for color in (ambient, diffuse_color, specular_color):
            if color.format != self.COLOR_FORMAT:
                raise ValueError(f"colour operands must be {self.COLOR_FORMAT}, not {color.format}")
        for term in (diffuse, specular):
            if term.format != self.TERM_FORMAT:
                raise ValueError(f"terms must be {self.TERM_FORMAT}, not {term.format}")
        # At most 32 products and an ambient term of 34 bits each: 40 bits, far from an int64's end.
        fraction_bits = self.COLOR_FORMAT.fraction_bits + self.TERM_FORMAT.fraction_bits
        total = diffuse.codes @ diffuse_color.codes + specular.codes @ specular_color.codes
        total = total + (ambient.codes << self.TERM_FORMAT.fraction_bits)
        rounded = Fixed(UQ(17, fraction_bits), total).round_half_up(self.fraction_bits)
        codes = rounded.saturate(self.result_format).codes
        channels = codes.astype(np.uint16 if self.fraction_bits else np.uint8)
        return channels if self.channels == 3 else np.repeat(channels[:, :1], 3, axis=-1)

    def cycles(self, diffuse: Fixed, specular: Fixed) -> np.ndarray:
        """Cycles that each pixel takes in the compact unit: ``channels max(1, T)``, T terms not 0.

        Parameters
        ----------
        diffuse, specular : Fixed, shape (pixels, lights), UQ(0, 17)
            Terms of each light.

        Returns
        -------
        int64 array, shape (pixels,)
        """
        terms = np.concatenate([diffuse.codes, specular.codes], axis=-1)
        found: np.ndarray = self.channels * np.maximum(np.count_nonzero(terms, axis=-1), 1)
        return found
