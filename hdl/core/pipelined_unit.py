"""Pipelined unit: the base of every unit with a fixed latency and one common enable."""

from collections.abc import Mapping

from amaranth.hdl import Cat, EnableInserter, Module, Mux, ShapeLike, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Member, Out

from blysk.hdl.core.stream import skid_buffer, stop_output

__all__ = ["PipelinedUnit"]

_UNGROUPED, _GROUP = 36, 12
"""Pipelines of more than `_UNGROUPED` stages reduce their valid bits in groups of `_GROUP`."""


class PipelinedUnit(wiring.Component):
    """A unit with a fixed latency and initiation interval. One common enable moves its beats.

    A beat is on the output ``latency`` cycles after it was accepted. After a cycle on which the sink does not
    take a beat, the whole unit is disabled and holds its payloads (`skid_buffer`). While a beat is inside,
    the next beat is accepted a whole multiple of ``initiation_interval`` enabled cycles later. In a *spaced*
    unit it is accepted any number of enabled cycles later, from ``initiation_interval`` on. ``i.ready`` and
    ``o.valid`` follow from the unit's registers alone. Reset empties the unit.

    A subclass describes its registers in `datapath`, as if they were enabled on every cycle. Control comes
    from the *stage* of a beat: `at` tells whether a beat was accepted a number of enabled cycles ago.

    Parameters
    ----------
    input_shape, output_shape : ShapeLike
        Payloads.
    latency : int
        Cycles from input to output, at least 1.
    initiation_interval : int
        Cycles from an input to the next. With 1, `datapath` gets the input, and registers it. With more, it
        gets a register that holds the input on stages 1 to ``initiation_interval``.
    constants : ShapeLike or None
        Shape of the port ``constants``: values that are constant while beats are inside. ``None``: no port.
    spaced : bool
        Whether the next beat may come any number of cycles later, from ``initiation_interval`` on.
    ports : mapping of str to Member, optional
        Further members, by name.
    skid : bool
        Whether a spare register holds a beat that is not accepted (`skid_buffer`). Without the spare register
        the unit is disabled while a beat is on the output, for one cycle at least (`stop_output`). So without
        stalls a beat comes every ``initiation_interval + 1`` cycles.
    stands : bool
        Whether the result of `datapath` stays for one more cycle. Then the skid buffer needs no spare
        register. This needs an ``initiation_interval`` over 1.

    Members
    -------
    i : :py:`In(stream.Signature(input_shape))`
        Operands.
    o : :py:`Out(stream.Signature(output_shape))`
        Results.
    constants : :py:`In(constants)`
        Only if ``constants`` is given.

    Attributes
    ----------
    advance : Signal
        The common enable, from `elaborate` on, for logic of the unit outside its data path.
    latency, initiation_interval, skid, stands
        The arguments of the constructor.
    """

    def __init__(
        self,
        input_shape: ShapeLike,
        output_shape: ShapeLike,
        *,
        latency: int,
        initiation_interval: int = 1,
        constants: ShapeLike | None = None,
        spaced: bool = False,
        ports: Mapping[str, Member] | None = None,
        skid: bool = True,
        stands: bool = False,
    ):
        if latency < 1 or initiation_interval < 1:
            raise ValueError("latency and initiation_interval must be at least 1")
        self.latency = latency
        self.initiation_interval = initiation_interval
        self._spaced, self.skid, self.stands = spaced, skid, stands
        if spaced and not skid:
            raise ValueError("a spaced unit needs its skid buffer")
        if stands and not (skid and initiation_interval > 1):
            raise ValueError("a result that stands needs a skid buffer and an interval over 1")
        members = {"i": In(stream.Signature(input_shape)), "o": Out(stream.Signature(output_shape))}
        if constants is not None:
            members["constants"] = In(constants)
        super().__init__(members | dict(ports or {}))

    def datapath(self, m: Module, operands):
        """Describe the registers in ``m``. Return the payload of the output, ``latency`` registers later."""
        raise NotImplementedError

    def at(self, stage: int) -> Value:
        """Whether a beat was accepted ``stage`` enabled cycles ago. ``stage`` is 1 to ``latency``."""
        return self._stages[stage - 1]

    @staticmethod
    def register(m: Module, value, name: str, *, when: Value | None = None):
        """A register that takes ``value`` on every enabled cycle. With ``when``, only while this is high.

        It has no reset, because `at` tells whether its data belongs to a beat. A multiplier's own registers
        can take its place.
        """
        register = Signal(value.shape(), name=name, reset_less=True)
        if when is None:
            m.d.sync += register.eq(value)
        else:
            with m.If(when):
                m.d.sync += register.eq(value)
        return register

    def elaborate(self, platform):
        """Build the control and put the data path under the common enable."""
        m = Module()
        self._stages = Signal(self.latency, name="stages")
        self.advance = advance = Signal(name="advance")
        accept = Signal()
        if self.initiation_interval == 1:
            m.d.comb += self.i.ready.eq(advance)
        else:
            schedule = self._wait if self._spaced else self._turn
            m.d.comb += self.i.ready.eq(schedule(m, advance, accept))
        m.d.comb += accept.eq(self.i.valid & self.i.ready)
        with m.If(advance):
            m.d.sync += self._stages.eq(Cat(accept, self._stages[:-1]))

        inner = Module()
        operands = self.i.payload
        if self.initiation_interval > 1:
            # The register also takes operands that are not valid. No stage is set for them.
            operands = self.register(inner, operands, "operands", when=self.i.ready)
        result = self.datapath(inner, operands)
        m.submodules.datapath = EnableInserter(advance)(inner)
        if self.skid:
            m.d.comb += advance.eq(skid_buffer(m, self.o, self._stages[-1], result, self.stands))
        else:
            before = self._stages[-2] if self.latency > 1 else accept
            m.d.comb += advance.eq(stop_output(m, self.o, before, result))
        return m

    def _wait(self, m: Module, advance: Value, accept: Value) -> Value:
        """Whether a beat may come, ``initiation_interval`` or more enabled cycles after the last beat.

        This is a register, computed a cycle ahead.
        """
        ready = Signal(name="ready", init=1)
        left = Signal(range(self.initiation_interval), name="left")
        following = Signal.like(left, name="following")
        m.d.comb += following.eq(
            Mux(accept, self.initiation_interval - 1, Mux((left != 0) & advance, left - 1, left))
        )
        waits = self.o.valid & ~self.o.ready
        m.d.sync += [left.eq(following), ready.eq(~waits & (following == 0))]
        return ready

    def _turn(self, m: Module, advance: Value, accept: Value) -> Value:
        """Whether a beat may come. Shared parts serve the beats of several stages in fixed slots.

        This is a register, computed a cycle ahead.
        """
        ready, turn = Signal(name="ready", init=1), Signal(range(self.initiation_interval))
        # Whether a beat will be inside on the next cycle even if no beat comes on this cycle.
        stays, opens = Signal(name="stays"), Signal(name="opens")
        inside = Cat(accept, self._stages)[: self.latency - 1]
        if self.latency > _UNGROUPED:
            # The valid bits are reduced in groups. Each group is computed a cycle ahead, from the stages
            # before its own.
            parts = [Signal(name=f"inside_{k}") for k in range(-(-(self.latency - 3) // _GROUP))]
            with m.If(advance):
                m.d.sync += [
                    part.eq(inside[1 + k * _GROUP : 1 + (k + 1) * _GROUP].any())
                    for k, part in enumerate(parts)
                ]
            inside = Cat(inside[:2], *parts)
        m.d.comb += opens.eq((turn == self.initiation_interval - 1) | ~(accept | stays))
        with m.If(advance):
            m.d.sync += [
                stays.eq(inside.any()),
                turn.eq(Mux(opens, 0, turn + 1)),
            ]
        if not self.skid:
            with m.If(advance):
                m.d.sync += ready.eq(opens)
            return ready & advance
        waits = self.o.valid & ~self.o.ready
        m.d.sync += ready.eq(~waits & Mux(advance, opens, turn == 0))
        return ready
