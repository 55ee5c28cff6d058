"""Intensity unit ([T] figure 4.10): ambient, diffuse and specular light of a pixel, in three channels."""

from amaranth.hdl import Signal, unsigned
from amaranth.lib import data

from golden.intensity import Intensity

from .fixed import FixedShape
from .stream import PipelinedUnit

__all__ = ["IntensityUnit", "color_shape", "pixel_color_shape"]


def color_shape() -> data.ArrayLayout:
    """Shape of a colour operand: red, green, blue in ``UQ(11, 6)``, in LSB of the 8-bit channel."""
    return data.ArrayLayout(FixedShape(Intensity.COLOR_FORMAT), 3)


def pixel_color_shape() -> data.StructLayout:
    """Shape of a shaded pixel: red, green, blue in 8 bits."""
    return data.StructLayout({"r": unsigned(8), "g": unsigned(8), "b": unsigned(8)})


class IntensityUnit(PipelinedUnit):
    """``I = k_a I_a + sum_i I_i (k_d D_i + k_s S_i)`` a channel, saturated to 255 and rounded half up.

    Formats and error are those of `golden.intensity.Intensity`, the bit-true twin. Nothing wraps: the sum
    grows by a bit at each level of the adder tree.

    The latency is ``3 + ceil(log2(2 lights + 1))`` clocks (products, adder tree, rounding, saturation) and
    the initiation interval is 1. Six multipliers a light.

    Parameters
    ----------
    parameters : Intensity
        Number of lights.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse": ..., "specular": ...})))`
        One term a light, ``UQ(0, 17)``.
    o : :py:`Out(stream.Signature(pixel_color_shape()))`
        Channels.
    constants : :py:`In(StructLayout({"ambient", "diffuse", "specular"}))`
        Colour operands, the latter two one a light; stay while beats are inside.

    Source: [T] figure 4.10; [B] 4 and 5.
    """

    def __init__(self, parameters: Intensity | None = None):
        self.parameters = parameters or Intensity()
        lights = self.parameters.lights
        terms = data.ArrayLayout(FixedShape(Intensity.TERM_FORMAT), lights)
        colors = data.ArrayLayout(color_shape(), lights)
        super().__init__(
            data.StructLayout({"diffuse": terms, "specular": terms}),
            pixel_color_shape(),
            latency=3 + (2 * lights).bit_length(),
            constants=data.StructLayout({"ambient": color_shape(), "diffuse": colors, "specular": colors}),
        )

    def datapath(self, m, operands):
        """Products, a binary tree of sums, rounding, saturation."""
        register = self.register
        result = Signal(self.o.payload.shape())
        for channel, name in enumerate("rgb"):
            terms = [register(m, self.constants.ambient[channel], f"ambient_{name}")]
            for light in range(self.parameters.lights):
                terms += [
                    register(m, term[light] * color[light][channel], f"{kind}_{light}_{name}")
                    for kind, term, color in (
                        ("diffuse", operands.diffuse, self.constants.diffuse),
                        ("specular", operands.specular, self.constants.specular),
                    )
                ]
            level = 0
            while len(terms) > 1:
                pairs = [terms[k : k + 2] for k in range(0, len(terms), 2)]
                terms = [
                    register(m, pair[0] + pair[1] if len(pair) == 2 else pair[0], f"sum_{level}_{k}_{name}")
                    for k, pair in enumerate(pairs)
                ]
                level += 1
            rounded = register(m, terms[0].round_half_up(0), f"rounded_{name}")
            m.d.comb += result[name].eq(
                register(m, rounded.saturate(Intensity.RESULT_FORMAT), name).as_value()
            )
        return result
