"""Half-way vector ([T] figure 4.10, vector H): between the directions of the light and of the viewer."""

from amaranth.hdl import Cat, Const, Module, Mux, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.halfway_vector import HalfwayVector
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.geometry.vector_normaliser import VectorNormaliserUnit

__all__ = ["HalfwayVectorUnit"]


class HalfwayVectorUnit(wiring.Component):
    """Half-way vectors by a sum and a normaliser. `HalfwayVector` is the bit-accurate model.

    The latency (`latency`) is 18 cycles, and the initiation interval is 1. There are six multipliers, as in
    `VectorNormaliserUnit`.

    Parameters
    ----------
    model : HalfwayVector
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"light": ..., "viewer": ...})))`
        Unit vectors L and V, ``SQ(1, 17)``.
    o : :py:`Out(stream.Signature(StructLayout({"halfway": ..., "opposite": 1})))`
        H, ``SQ(1, 17)``. ``opposite``: L and V are opposite, and H is 0.

    Source: docs/theory/geometry.md#half-way-vector; [T] figure 4.10.
    """

    def __init__(self, model: HalfwayVector | None = None):
        self.model = model or HalfwayVector()
        self._normaliser = VectorNormaliserUnit(self.model.normaliser)
        self.latency = self._normaliser.latency
        given = data.StructLayout({"light": normal_shape(), "viewer": normal_shape()})
        made = data.StructLayout({"halfway": normal_shape(), "opposite": unsigned(1)})
        super().__init__({"i": In(stream.Signature(given)), "o": Out(stream.Signature(made))})

    def elaborate(self, platform):
        """The sum of L and V, and the normaliser of half of the sum.

        Half of the sum has the same bits as the sum, with another binary point. If L and V are opposite, the
        normaliser finds no direction (``lost``), and H is 0.
        """
        m = Module()
        m.submodules.normaliser = normaliser = self._normaliser
        vector, normal = normaliser.i.payload.vector, normaliser.o.payload.normal
        lost = normaliser.o.payload.lost
        m.d.comb += [
            normaliser.i.valid.eq(self.i.valid),
            self.i.ready.eq(normaliser.i.ready),
            self.o.valid.eq(normaliser.o.valid),
            normaliser.o.ready.eq(self.o.ready),
            self.o.payload.opposite.eq(lost),
        ]
        for k in range(3):
            light, viewer = (Value.cast(self.i.payload[name][k]) for name in ("light", "viewer"))
            total = (light + viewer)[: HalfwayVector.SUM_FORMAT.width]
            below = len(Value.cast(vector[k])) - len(total)
            m.d.comb += [
                Value.cast(vector[k]).eq(Cat(Const(0, below), total)),
                Value.cast(self.o.payload.halfway[k]).eq(Mux(lost, 0, Value.cast(normal[k]))),
            ]
        return m
