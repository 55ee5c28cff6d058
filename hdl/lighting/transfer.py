"""Transfer unit: from linear light to the sRGB codes of a picture, by a table."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib.memory import Memory

from blysk.golden.lighting.transfer import Transfer
from blysk.hdl.core.bits import leading_zeros, select
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.lighting.intensity import pixel_color_shape

__all__ = ["TransferUnit"]


class TransferUnit(PipelinedUnit):
    """The sRGB codes of a pixel's channels. `Transfer` is the bit-accurate model.

    With an initiation interval of 1 the latency is 4 cycles: address, two for the word, sum. The table has a
    read port for each channel. On an ECP5 three ports take two block RAMs of 1024 by 18 bits, and a single
    port takes one block RAM. With an interval of 3 a single port serves the channels one after the other, and
    the latency is 8 cycles. There is no multiplier.

    Parameters
    ----------
    model : Transfer
        Bit-accurate model.
    channels : int
        3 or 1. With 1 every channel takes the light of red.
    initiation_interval : int
        Cycles from an input to the next, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(pixel_color_shape(6)))`
        Linear light of the channels in ``UQ(8, 6)``.
    o : :py:`Out(stream.Signature(pixel_color_shape()))`
        Codes of the channels.

    Raises
    ------
    ValueError
        If the number of channels or the interval is out of range.

    Source: docs/theory/textures.md#transfer; IEC 61966-2-1.
    """

    def __init__(self, model: Transfer | None = None, channels: int = 3, initiation_interval: int = 1):
        if channels not in (1, 3):
            raise ValueError(f"channels must be 1 or 3, not {channels}")
        self.model = model or Transfer()
        self.channels = channels
        self._graph = g = Dataflow(initiation_interval, spaced=True)
        # A shared table takes the light itself, so `_placed` exists once, behind the multiplexers.
        shares, bits = initiation_interval > 1, Transfer.OPERAND_FORMAT.width
        shape = unsigned(bits) if shares else unsigned(len(_placed(Const(0, bits))))
        table = g.share("transfer", (shape,), 3 + shares, self._look_up)
        self._codes = []
        for name in "rgb"[:channels]:
            light = g.input(f"light_{name}", lambda operands, name=name: Value.cast(operands[name]), name)
            given = (lambda x: (x,)) if shares else (lambda x: (_placed(x),))
            code = g.use(table, name, (light,), given, formula=f"sRGB of {name}")
            self._codes.append(code)
        super().__init__(
            pixel_color_shape(Transfer.OPERAND_FORMAT.fraction_bits),
            pixel_color_shape(),
            latency=max(code.stage for code in self._codes),
            initiation_interval=initiation_interval,
            spaced=True,
        )

    def datapath(self, m, operands):
        """The table, with a port for each instance, and the registers of the graph."""
        p = self.model
        words = p.words.tolist()
        m.submodules.table = self._table = Memory(shape=p.WORD_FORMAT.width, depth=len(words), init=words)
        self._module = m
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        codes = [at(code, self.latency) for code in self._codes]
        for name, code in zip("rgb", codes * (3 // len(codes)), strict=True):
            m.d.comb += result[name].eq(code)
        return result

    def _look_up(self, register: Callable[[Any, str], Any], operand: Value) -> Value:
        """Code of a channel: the sum of the part's word and the place in the part."""
        placed = register(_placed(operand), "placed") if self.initiation_interval > 1 else operand
        fraction_bits = Transfer.WORD_FORMAT.fraction_bits
        port = self._table.read_port()
        self._module.d.comb += port.addr.eq(placed[fraction_bits:])
        place = register(register(placed[:fraction_bits], "place_read"), "place")
        total = register(port.data, "word") + place
        return register(total[fraction_bits : fraction_bits + Transfer.RESULT_FORMAT.width], "code")


def _placed(light: Value) -> Value:
    """Place of a channel's light within its part. Above these bits is the address of the part."""
    parts, fraction_bits = Transfer.PART_BITS, Transfer.WORD_FORMAT.fraction_bits
    # Seven minus the leading zeros. In octave 0 each input is a part of its own.
    octave = ~leading_zeros(light[parts:])
    shifts = [max(k - 1, 0) for k in range(len(light) - parts + 1)]
    part = select([light[shift : shift + parts] for shift in shifts], octave)
    # Bit k belongs to the place if the leading one stands more than `parts` bits above it.
    place = Cat(light[k] & light[parts + 1 + k :].any() for k in range(fraction_bits))
    return Cat(place, part, octave)
