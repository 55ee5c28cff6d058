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
    """Intensity of a channel: ``I = k_a I_a + sum_i I_i (k_d D_i + k_s S_i)``, rounded half up and saturated.

    The products ``k I`` are inputs, *colour operands* in LSB of the 8-bit channel. Their format is
    ``UQ(11, 6)``, 17 bits for the multipliers. So a term may reach 2047.98 LSB, eight times the full channel.
    The sum is exact. The rounding of an operand adds 2^-7 LSB times a term of at most 1. The rounding of the
    result adds 1/2 LSB, or 2^-7 LSB with 6 fraction bits.

    *Albedo.* With ``has_albedo`` the colour ``a`` of the surface at a pixel multiplies ambient and diffuse
    light, and E is emitted light: ``I = a (k_a I_a + sum_i I_i k_d D_i) + E + sum_i I_i k_s S_i``. On a
    *tinted* material ``a`` multiplies the specular sum, too. The factor of ``a`` is the *light on the
    surface*. It is rounded by at most 2^-7 LSB, and limited to 4095.98 LSB, sixteen times the full channel.
    With one light and no tint it is below this limit. The product is exact.

    Parameters
    ----------
    lights : int
        Number of lights, 0 to 16.
    has_specular : bool
        Whether there are specular terms. If not, their inputs must be 0.
    channels : int
        3 or 1. With 1 every channel takes the colour operands of red.
    has_albedo : bool
        Whether each pixel brings an albedo, and the constants have the emission E.
    tints : bool
        Whether a constant tells if a material is tinted.
    fraction_bits : int
        Fraction bits of the result: 0 for the codes of a picture in linear light, 6 if a `Transfer` follows.

    Raises
    ------
    ValueError
        If the number of lights, channels or fraction bits is out of range. If there are tints without
        albedo or specular terms.

    Source: docs/theory/units.md#intensity; [B] 4 and 5, [T] figure 4.10.
    """

    lights: int = 1
    has_specular: bool = True
    channels: int = 3
    has_albedo: bool = False
    tints: bool = False
    fraction_bits: int = 0

    COLOR_FORMAT = UQ(11, 6)
    TERM_FORMAT = UQ(0, 17)
    ALBEDO_FORMAT = UQ(1, 16)
    SURFACE_FORMAT = UQ(12, 6)

    PADDING = 2
    """Extra cycles between the last product of the light on the surface and the product with the albedo."""

    def __post_init__(self) -> None:
        if not 0 <= self.lights <= MAX_LIGHTS:
            raise ValueError(f"lights must be 0 to {MAX_LIGHTS}, not {self.lights}")
        if self.channels not in (1, 3):
            raise ValueError(f"channels must be 1 or 3, not {self.channels}")
        if self.fraction_bits not in (0, 6):
            raise ValueError(f"fraction_bits must be 0 or 6, not {self.fraction_bits}")
        if self.tints and not (self.has_albedo and self.has_specular):
            raise ValueError("tints need an albedo and specular terms")

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
        self,
        ambient: Fixed,
        diffuse_color: Fixed,
        specular_color: Fixed,
        diffuse: Fixed,
        specular: Fixed,
        albedo: Fixed | None = None,
        emission: Fixed | None = None,
        tinted: bool = False,
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
        albedo : Fixed, shape (pixels, 3), UQ(1, 16), optional
            Albedo of each pixel, at most 1; with ``has_albedo`` alone.
        emission : Fixed, shape (3,), UQ(11, 6), optional
            Colour operand E; with ``has_albedo`` alone, by default 0.
        tinted : bool
            Whether the albedo multiplies the specular sum; with ``tints`` alone.

        Returns
        -------
        uint8 array, shape (pixels, 3)

        Raises
        ------
        ValueError
            If an operand has another format. If an operand for the albedo is missing, or the unit has no
            albedo.
        """
        for color in (ambient, diffuse_color, specular_color, emission):
            if color is not None and color.format != self.COLOR_FORMAT:
                raise ValueError(f"colour operands must be {self.COLOR_FORMAT}, not {color.format}")
        for term in (diffuse, specular):
            if term.format != self.TERM_FORMAT:
                raise ValueError(f"terms must be {self.TERM_FORMAT}, not {term.format}")
        if (albedo is not None) != self.has_albedo or (emission is not None and not self.has_albedo):
            has, lack = ("an", "lack it") if self.has_albedo else ("no", "bring it")
            raise ValueError(f"the unit has {has} albedo, its operands {lack}")
        if tinted and not self.tints:
            raise ValueError("the unit has no tints, and the material is tinted")
        # At most 32 products and an ambient term of 34 bits each: 40 bits, far from an int64's end.
        term_bits = self.TERM_FORMAT.fraction_bits
        fraction_bits = self.COLOR_FORMAT.fraction_bits + term_bits
        total, shine = diffuse.codes @ diffuse_color.codes, specular.codes @ specular_color.codes
        total = total + (ambient.codes << term_bits)
        if albedo is None:
            total = total + shine
        else:
            if albedo.format != self.ALBEDO_FORMAT:
                raise ValueError(f"the albedo must be {self.ALBEDO_FORMAT}, not {albedo.format}")
            light = Fixed(UQ(17, fraction_bits), total + shine if tinted else total)
            surface = light.round_half_up(self.SURFACE_FORMAT.fraction_bits).saturate(self.SURFACE_FORMAT)
            colored = surface * albedo
            total = colored.codes << fraction_bits - colored.format.fraction_bits
            total = (
                total + (0 if tinted else shine) + (0 if emission is None else emission.codes << term_bits)
            )
        rounded = Fixed(UQ(17, fraction_bits), total).round_half_up(self.fraction_bits)
        codes = rounded.saturate(self.result_format).codes
        channels = codes.astype(np.uint16 if self.fraction_bits else np.uint8)
        return channels if self.channels == 3 else np.repeat(channels[:, :1], 3, axis=-1)

    def cycles(self, diffuse: Fixed, specular: Fixed, tinted: bool = False) -> np.ndarray:
        """Cycles that each pixel takes in the compact unit.

        These are ``channels max(1, T)`` for T terms that are not 0, with an albedo ``channels (1 + T)``. A
        single channel with an albedo takes two more if a term is multiplied by the albedo.

        Parameters
        ----------
        diffuse, specular : Fixed, shape (pixels, lights), UQ(0, 17)
            Terms of each light.
        tinted : bool
            Whether the albedo multiplies the specular terms.

        Returns
        -------
        int64 array, shape (pixels,)
        """
        terms = np.concatenate([diffuse.codes, specular.codes], axis=-1)
        count = np.count_nonzero(terms, axis=-1)
        if not self.has_albedo:
            found: np.ndarray = self.channels * np.maximum(count, 1)
            return found
        found = self.channels * (count + 1)
        multiplied = terms if tinted else diffuse.codes
        return found + self.PADDING * np.any(multiplied, axis=-1) if self.channels == 1 else found

    @property
    def most_cycles(self) -> int:
        """Cycles of a pixel without a term of 0 in the compact unit."""
        terms = Fixed(self.TERM_FORMAT, np.ones((1, self.lights), dtype=np.int64))
        return int(self.cycles(terms, terms[:, : self.lights if self.has_specular else 0])[0])
