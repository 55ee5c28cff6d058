"""Output cells: pins that send two bits a cycle."""

from collections.abc import Sequence

from amaranth.hdl import Module, Signal
from amaranth.lib import data, io, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["OutputCells"]


class OutputCells(wiring.Component):
    """A cell for each lane. It sends bit 0 of a pair in the first half of a cycle, then bit 1.

    With ports the cell is the FPGA's own cell (``ODDRX1F`` on ECP5), made by Amaranth's `DDRBuffer`. Without
    ports it is a model of this cell. On each cycle ``bits`` has the pair that the pins send, two cycles after
    its input, as with ``ODDRX1F``. The cells are in the domain ``serial``.

    Parameters
    ----------
    lanes : int
        Lanes.
    ports : sequence of amaranth.lib.io.PortLike, optional
        One port for each lane, which is a pin or a differential pair.

    Members
    -------
    pairs : :py:`In(data.ArrayLayout(2, lanes))`
        Pairs to send.
    bits : :py:`Out(data.ArrayLayout(2, lanes))`
        Sent pairs. Only without ports.

    Source: docs/theory/video.md#tmds.
    """

    def __init__(self, lanes: int, ports: Sequence[io.PortLike] | None = None):
        if ports is not None and len(ports) != lanes:
            raise ValueError(f"{lanes} lanes need {lanes} ports, not {len(ports)}")
        self._ports = ports
        members = {"pairs": In(data.ArrayLayout(2, lanes))}
        super().__init__(
            members if ports is not None else members | {"bits": Out(data.ArrayLayout(2, lanes))}
        )

    def elaborate(self, platform):
        """Buffers, or two registers in their place."""
        m = Module()
        if self._ports is None:
            waiting = Signal(self.pairs.shape(), name="waiting")
            sent = Signal(self.pairs.shape(), name="sent")
            m.d.serial += [waiting.eq(self.pairs), sent.eq(waiting)]
            m.d.comb += self.bits.eq(sent)
            return m
        for k, port in enumerate(self._ports):
            m.submodules[f"lane_{k}"] = cell = io.DDRBuffer("o", port, o_domain="serial")
            m.d.comb += [cell.o[half].eq(self.pairs[k][half]) for half in range(2)]
        return m
