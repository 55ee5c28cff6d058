"""TMDS encoder: a byte of colour as ten bits with few transitions and no direct current."""

from amaranth.hdl import Cat, Const, Mux, Signal, signed, unsigned
from amaranth.lib import data

from blysk.golden.video.tmds_encoder import BITS, CONTROL_WORDS, TmdsEncoder
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["SYMBOL", "TmdsEncoderUnit"]

SYMBOL = data.StructLayout({"data": 8, "control": 2, "active": 1})
"""Shape of an input. If ``active``, the byte ``data`` is sent, else ``control``.

``control`` has the control bits c0 and c1, as ``c0 + 2 c1``.
"""


class TmdsEncoderUnit(PipelinedUnit):
    """Ten bits for a byte or a control period. `TmdsEncoder` is the bit-accurate model.

    The unit gives a word a cycle, 3 cycles after its input. The first cycle makes the chain by XOR or XNOR,
    the second counts its ones, the third inverts the word or not. The unit has no multipliers.

    Parameters
    ----------
    model : TmdsEncoder
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(SYMBOL))`
        Bytes or control bits to send.
    o : :py:`Out(stream.Signature(10))`
        The word. Bit 0 has to be sent first.

    Attributes
    ----------
    disparity : Signal
        Number of ones minus number of zeros sent since the last control word. It exists from `elaborate` on.
    chain, excess : Value
        The word's eight bits before the balance, and half of the difference of their ones and zeros. They
        come a cycle before the output.

    Source: docs/theory/video.md#tmds.
    """

    def __init__(self, model: TmdsEncoder | None = None):
        self.model = model or TmdsEncoder()
        super().__init__(SYMBOL, unsigned(BITS), latency=self.model.latency)

    def datapath(self, m, operands):
        """The chain, its ones minus its zeros, then the inversion and the disparity.

        The number of ones in the byte chooses XOR or XNOR.
        """
        byte = operands.data
        ones = Signal(range(9), name="ones")
        use_xor, chain = Signal(name="use_xor"), Signal(8, name="chain")
        m.d.comb += [
            ones.eq(sum(byte)),
            use_xor.eq((ones < 4) | ((ones == 4) & byte[0])),
            *(chain[k].eq(byte[: k + 1].xor() ^ (~use_xor if k % 2 else Const(0))) for k in range(8)),
        ]
        first, xor = self.register(m, chain, "chain_1"), self.register(m, use_xor, "xor_1")
        symbol = self.register(m, Cat(operands.control, operands.active), "symbol_1")
        half = Signal(signed(4), name="half")
        m.d.comb += half.eq(sum(first) - 4)
        # The excess and the disparity are even, so registers hold half of each.
        excess = self.register(m, half, "excess")
        word, xor = self.register(m, first, "chain_2"), self.register(m, xor, "xor_2")
        symbol = self.register(m, symbol, "symbol_2")
        self.chain, self.excess = word, excess
        control, active = symbol[:2], symbol[2]

        self.disparity = Signal(signed(5), name="disparity")
        before, after = Signal(signed(4), name="before"), Signal(signed(4), name="after")
        invert = Signal(name="invert")
        balanced = (before == 0) | (excess == 0)
        m.d.comb += [
            self.disparity.eq(before << 1),
            invert.eq(Mux(balanced, ~xor, before[-1] == excess[-1])),
            after.eq((before + Mux(invert, -excess, excess) + xor + invert - 1)[:4].as_signed()),
        ]
        with m.If(self.at(2)):
            m.d.sync += before.eq(Mux(active, after, 0))
        coloured = Cat(Mux(invert, ~word, word), xor, invert)
        words = [Const(word, BITS) for word in CONTROL_WORDS]
        blank = Mux(control[1], Mux(control[0], words[3], words[2]), Mux(control[0], words[1], words[0]))
        return self.register(m, Mux(active, coloured, blank), "result")
