"""Bit-accurate model of the factor unit: the specular term of a light that fades, times its factor."""

from dataclasses import dataclass

from blysk.golden.number.fixed import UQ, Fixed

__all__ = ["Factor"]


@dataclass(frozen=True)
class Factor:
    """Product ``a S`` of a specular term S and a factor a of distance and spot, cut to 17 fraction bits.

    The diffuse term needs no product here: N·L of a light that fades already contains a.

    ====== ========= =============================================
    word   format    why
    ====== ========= =============================================
    a      UQ(0, 17) multiplier operand; 1 is ``1 - 2^-17``
    S      UQ(0, 17) multiplier operand, result of a specular unit
    a S    UQ(0, 17) cut: at most S and at most a
    ====== ========= =============================================

    The result is at most the exact product. The difference is under 2^-17, 0.002 LSB of a full channel.

    Source: docs/theory/chord.md#local-lights.
    """

    FORMAT = UQ(0, 17)

    def compute(self, specular: Fixed, factor: Fixed) -> Fixed:
        """Bit-accurate products.

        Parameters
        ----------
        specular, factor : Fixed, any shape, UQ(0, 17)
            S and a.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if {specular.format, factor.format} != {self.FORMAT}:
            raise ValueError(f"operands must be {self.FORMAT}, not {specular.format}, {factor.format}")
        return (specular * factor).truncate(self.FORMAT.fraction_bits)
