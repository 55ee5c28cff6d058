"""Light unit: diffuse and specular term of one light ([T] figure 4.10)."""

from amaranth.hdl import Module, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.diffuse import Diffuse
from golden.specular import Specular

from .diffuse import DiffuseUnit
from .dot_product import DotProductUnit
from .fixed import FixedShape
from .middle_normal import normal_shape
from .specular import SpecularUnit
from .stream import connect

__all__ = ["LightUnit"]


class LightUnit(wiring.Component):
    """``max(N . L, 0)`` and the reflection model of ``N . H``, for one light.

    Two chains, of a dot product and the diffuse unit, and of a dot product and the specular unit, run in
    lockstep: their latencies are equal, they are offered the same beats and taken from on the same clocks, so
    what holds of one handshake holds of the other. The first chain tells the second when the light is behind
    the surface.

    The latency is 10 clocks and the initiation interval 1. Eight multipliers.

    Parameters
    ----------
    parameters : Specular
        Reflection model.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normal.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse", "specular"})))`
        Terms, ``UQ(0, 17)``.
    constants : :py:`In(StructLayout({"direction", "halfway", "exponent"}))`
        Unit vectors L and H, and the exponent; stay while beats are inside.

    Source: [T] figure 4.10; [B] 4.
    """

    initiation_interval = 1

    def __init__(self, parameters: Specular | None = None):
        self.parameters = parameters or Specular()
        self._dot_light, self._dot_halfway = DotProductUnit(), DotProductUnit()
        self._specular = SpecularUnit(self.parameters)
        self._diffuse = DiffuseUnit(self._specular.latency)
        self.latency = self._dot_light.latency + self._diffuse.latency
        super().__init__(
            {
                "i": In(stream.Signature(normal_shape())),
                "o": Out(
                    stream.Signature(
                        data.StructLayout(
                            {
                                "diffuse": FixedShape(Diffuse.RESULT_FORMAT),
                                "specular": FixedShape(Specular.RESULT_FORMAT),
                            }
                        )
                    )
                ),
                "constants": In(
                    data.StructLayout(
                        {
                            "direction": normal_shape(),
                            "halfway": normal_shape(),
                            "exponent": unsigned(Specular.EXPONENT_BITS),
                        }
                    )
                ),
            }
        )

    def elaborate(self, platform):
        """Two chains side by side."""
        m = Module()
        m.submodules.dot_light = dot_light = self._dot_light
        m.submodules.dot_halfway = dot_halfway = self._dot_halfway
        m.submodules.diffuse = diffuse = self._diffuse
        m.submodules.specular = specular = self._specular
        for dot, vector in ((dot_light, self.constants.direction), (dot_halfway, self.constants.halfway)):
            m.d.comb += [
                dot.i.payload.a.eq(self.i.payload),
                dot.i.payload.b.eq(vector),
                dot.i.valid.eq(self.i.valid),
            ]
        cosine = Value.cast(dot_light.o.payload)
        connect(m, dot_light.o, diffuse.i)
        m.d.comb += [
            self.i.ready.eq(dot_light.i.ready),
            specular.i.payload.operand.eq(dot_halfway.o.payload),
            specular.i.payload.dark.eq(cosine[-1] | ~cosine.any()),
            specular.i.valid.eq(dot_halfway.o.valid),
            dot_halfway.o.ready.eq(specular.i.ready),
            specular.constants.exponent.eq(self.constants.exponent),
            self.o.payload.diffuse.eq(diffuse.o.payload),
            self.o.payload.specular.eq(specular.o.payload),
            self.o.valid.eq(diffuse.o.valid),
            diffuse.o.ready.eq(self.o.ready),
            specular.o.ready.eq(self.o.ready),
        ]
        return m
