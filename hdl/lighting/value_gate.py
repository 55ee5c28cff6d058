"""Value gate unit: three values of u decide whether a span of ``chord-local`` has a visible highlight."""

from amaranth.hdl import Cat, Const, Mux, Signal, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Member

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.lighting.value_gate import ValueGate
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["ValueGateUnit"]


class ValueGateUnit(PipelinedUnit):
    """Decides whether a span may be lit.

    The result is 0 only if every pixel of the span has a specular term of 0. `ValueGate` is the bit-accurate
    model. The latency is 3 cycles, the initiation interval 1. There is no multiplier. The PROM, which all
    lights share, holds 1024 words of 18 bits.

    Parameters
    ----------
    model : ValueGate
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    exponent : int or None
        The exponent, 1 to 1000, fixed at build time. There is then no PROM. ``None``: the exponent is a port.
    takes_threshold : bool
        Whether the threshold is a port in place of the exponent, as for the tables of a `Lobe`. There is then
        no PROM.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(ArrayLayout(UQ(1, 26), 3), lights)))`
        u of each light at the first pixel, in the middle and at the last pixel.
    o : :py:`Out(stream.Signature(unsigned(lights)))`
        Whether the span may be lit, a bit for each light. Bit 0 is the first light.
    constants : :py:`In(10)` or :py:`In(18)`
        The exponent or the threshold, if it is a port. It is constant from 2 cycles before a beat on.

    Source: docs/theory/units.md#highlight-gate.
    """

    def __init__(
        self,
        model: ValueGate | None = None,
        lights: int = 1,
        *,
        exponent: int | None = None,
        takes_threshold: bool = False,
    ):
        self.model = p = model or ValueGate()
        self.lights = lights
        self.exponent = exponent
        self.takes_threshold = takes_threshold
        constants = unsigned(p.specular.EXPONENT_BITS) if exponent is None else None
        if takes_threshold:
            constants = unsigned(p.THRESHOLD_FORMAT.width)
        values = data.ArrayLayout(FixedShape(ChordSetup.HIGHLIGHT_FORMAT), 3)
        super().__init__(
            data.ArrayLayout(values, lights),
            unsigned(lights),
            latency=3,
            constants=constants,
        )

    @property
    def ports(self) -> dict[str, Member]:
        """The port of exponent or threshold, for units that pass it on.

        There is no port if the exponent is fixed.
        """
        return {name: member for name, member in self.signature.members.items() if name == "constants"}

    def datapath(self, m, operands):
        """Sums and differences, the least u and whether it is valid, and the comparison."""
        p = self.model
        shift = p.LEVEL_FORMAT.fraction_bits - p.THRESHOLD_FORMAT.fraction_bits
        threshold = self._threshold(m) << shift
        lit = []
        for i, values in enumerate(operands):
            left, middle, right = (value.as_value() for value in values)
            smaller = self.register(m, Mux(left < right, left, right), f"smaller_{i}")
            bulge = self.register(m, left + right - (middle << 1), f"bulge_{i}")
            rise = self.register(m, right - left, f"rise_{i}")
            held = [
                (word < limit) & (word > -limit)
                for word, limit in ((bulge, p.LARGEST_BULGE), (rise, p.LARGEST_RISE))
            ]
            held = self.register(m, held[0] & held[1], f"held_{i}")
            least = self.register(m, (smaller << 1) - Mux(bulge > 0, bulge, 0), f"least_{i}")
            lit.append(~held | (least < threshold))
        return self.register(m, Cat(lit), "lit")

    def _threshold(self, m):
        """The word of the PROM, two cycles after the exponent."""
        p, width = self.model, self.model.THRESHOLD_FORMAT.width
        if self.takes_threshold:
            return self.register(m, self.constants, "threshold")
        if self.exponent is not None:
            return Const(p.thresholds.codes[self.exponent].item(), width)
        m.submodules.thresholds = prom = Memory(
            shape=width, depth=1 << p.specular.EXPONENT_BITS, init=p.thresholds.codes.tolist()
        )
        port = prom.read_port()
        threshold = Signal(width, name="threshold", reset_less=True)
        m.d.comb += port.addr.eq(self.constants)
        m.d.sync += threshold.eq(port.data)
        return threshold
