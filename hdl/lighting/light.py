"""Light unit: diffuse and specular term of one light ([T] figure 4.10)."""

from collections.abc import Callable
from typing import Any, NamedTuple

from amaranth.hdl import Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.factor import Factor
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.lighting.specular import Specular
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import pass_beside
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import connect, connect_fifo
from blysk.hdl.core.views import copy
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.factor import FactorUnit
from blysk.hdl.lighting.lobe import LobeMemory, LobeUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SlopeUnit, SpecularUnit

__all__ = ["SPECULAR_KINDS", "LightUnit", "SpecularKind", "kind_of"]


class SpecularKind(NamedTuple):
    """Kind of specular unit that a light or a pipeline may have.

    Parameters
    ----------
    unit : callable
        Function that makes the unit from its bit-accurate model and three options: ``initiation_interval``;
        ``exponent``, fixed at build time, or ``None``; ``shares_slope``, whether the slope unit, or the
        memory of a lobe, is outside. The unit has an attribute ``latency``.
    compact_interval : callable
        Function of the model and the fixed exponent (or ``None``). It gives the initiation interval at which
        one multiplier is enough.
    slope_unit : callable or None
        Function of the model. It makes a unit with the words that depend on the exponent alone, which serves
        all lights. ``None``: no words depend on the exponent alone.
    memory : callable or None
        Function of the model and the number of lights that makes the memory of the lights' tables. ``None``:
        no tables.
    constant : str
        Frame constant that the unit's port ``constants`` reads.
    """

    unit: Callable[..., PipelinedUnit]
    compact_interval: Callable[[Any, int | None], int]
    slope_unit: Callable[[Any], wiring.Component] | None = None
    memory: Callable[[Any, int], wiring.Component] | None = None
    constant: str = "exponent"


def _specular_unit(model: Specular, **options) -> PipelinedUnit:
    return SpecularUnit(model, **options)


def _power_unit(model: Power, *, initiation_interval: int, **_) -> PipelinedUnit:
    """Power unit: sequential from an interval of 42 on, else pipelined. The exponent needs no slope."""
    return PowerUnit(model, form="sequential" if initiation_interval >= 42 else "pipelined")


def _lobe_unit(model: Lobe, *, initiation_interval: int, shares_slope: bool, exponent: None) -> PipelinedUnit:
    """Lobe unit: tables in place of an exponent, in a memory of its own or outside."""
    tables = None if shares_slope else model.fixed_tables
    return LobeUnit(model, initiation_interval, tables=tables, shares_memory=shares_slope)


def _lobe_memory(model: Lobe, lights: int) -> LobeMemory:
    return LobeMemory(model, model.fixed_tables, lights)


_LOBE = SpecularKind(_lobe_unit, lambda model, exponent: 1, memory=_lobe_memory, constant="bank")

SPECULAR_KINDS: dict[type, SpecularKind] = {
    Lobe: _LOBE,
    QuotientLobe: _LOBE,
    Specular: SpecularKind(_specular_unit, SpecularUnit.multiplications, SlopeUnit),
    Power: SpecularKind(_power_unit, lambda model, exponent: 42),
}
"""Kinds of specular units, by the classes of their bit-accurate models."""


def kind_of(model: HighlightOperand) -> SpecularKind:
    """The kind of specular unit that a bit-accurate model describes.

    Raises
    ------
    TypeError
        If there is no unit for the model.
    """
    described = type(model)
    if described not in SPECULAR_KINDS:
        reason = f"SPECULAR_KINDS of {__name__} needs an entry for it"
        raise TypeError(f"{described.__name__} has no unit: {reason}")
    return SPECULAR_KINDS[described]


class LightUnit(wiring.Component):
    """Terms of one light: ``max(N . L, 0)``, and the reflection model of ``N . H``.

    A beat is dark if the light is behind the surface, or if a highlight gate tells that the span has no
    highlight.

    With an initiation interval of 1 the diffuse and the specular unit run in lockstep. Their latencies are
    equal, and they accept and give the same beats on the same cycles. So one handshake serves both. With a
    longer interval, dark beats bypass the specular unit. Dark beats wait in order beside the specular unit,
    and take two cycles each.

    For beats that are not dark, the specular unit determines the latency, the initiation interval and the
    multipliers. With a longer interval the latency is a cycle longer. For a light that fades a `FactorUnit`
    follows, which adds two cycles and a multiplier. The factor passes beside the units before it.

    Parameters
    ----------
    model : Specular or Power or Lobe
        Reflection model, and kind of ``highlight``: ``N . H`` or ``1 - N . H``.
    diffuse : Diffuse
        Format of ``N . L``.
    initiation_interval : int
        Cycles from an input to the next, at least 1. With a `Power`, a value of 42 or more becomes 42, and a
        smaller value becomes 1.
    exponent : int or None
        Exponent that is fixed at build time; see `SpecularUnit`.
    shares_slope : bool
        Whether slope and boundary come from a `SlopeUnit` outside. For a lobe, whether tables come from a
        `LobeMemory` outside. A `Power` needs no unit outside.
    gated : bool
        Whether there is a highlight gate.
    factor : FactorUnit or None
        Unit that multiplies the specular term by the factor of a light that fades. A unit without a factor
        only delays the terms by the same two cycles. ``None``: there is no such unit.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"cosine", "highlight", "gated", "factor"})))`
        ``N . L`` and the specular operand; ``gated``, only with a gate: the beat's span has no highlight;
        ``factor``, ``UQ(0, 17)``, only for a light that fades.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse", "specular"})))`
        Terms, ``UQ(0, 17)``.
    constants
        Port of the specular unit: exponent, slope or bank. Some specular units have no such port.
    table, write
        Ports of a `LobeUnit`, if the model is a `Lobe`.

    Source: docs/theory/models.md#lighting; [T] figure 4.10; [B] 4.
    """

    def __init__(
        self,
        model: Specular | Power | Lobe | None = None,
        diffuse: Diffuse | None = None,
        *,
        initiation_interval: int = 1,
        exponent: int | None = None,
        shares_slope: bool = False,
        gated: bool = False,
        factor: FactorUnit | None = None,
    ):
        self.model = p = model or Specular()
        self._specular = kind_of(p).unit(
            p, initiation_interval=initiation_interval, exponent=exponent, shares_slope=shares_slope
        )
        self.exponent = exponent
        self._factor = factor
        self.fades = factor is not None and factor.has_factor
        self.latency = self._specular.latency + (self._factor.latency if self._factor else 0)
        self.initiation_interval = self._specular.initiation_interval
        self.skips_dark = self.initiation_interval > 1
        self.latency += self.skips_dark
        self._diffuse = DiffuseUnit(diffuse, latency=2 if self.skips_dark else self._specular.latency)
        operands = {
            "cosine": FixedShape(self._diffuse.model.operand_format),
            "highlight": FixedShape(self.model.operand_format),
        }
        if gated:
            operands["gated"] = unsigned(1)
        if self.fades:
            operands["factor"] = FixedShape(Factor.FORMAT)
        terms = dict.fromkeys(("diffuse", "specular"), FixedShape(Diffuse.RESULT_FORMAT))
        members = {
            "i": In(stream.Signature(data.StructLayout(operands))),
            "o": Out(stream.Signature(data.StructLayout(terms))),
        }
        if exponent is None and self._has_constants:
            members["constants"] = self._specular.signature.members["constants"]
        super().__init__(members | self._forwarded)

    @property
    def _forwarded(self) -> dict:
        """Ports of a lobe's unit for its tables."""
        ports = self._specular.signature.members
        return {name: ports[name] for name in ("table", "write") if name in ports}

    @property
    def _has_constants(self) -> bool:
        """Whether the specular unit has constants."""
        return "constants" in self._specular.signature.members

    def elaborate(self, platform):
        """Two units side by side, and perhaps the factor unit behind them."""
        m = Module()
        o = self.o if self._factor is None else self._apply_factor(m)
        m.submodules.diffuse = diffuse = self._diffuse
        m.submodules.specular = specular = self._specular
        given = self.i.payload
        if self.skips_dark:
            given = Signal(given.shape(), name="given", reset_less=True)
        cosine = Value.cast(self.i.payload.cosine)
        dark = Signal()
        is_gated = self.i.payload.gated if "gated" in self.i.payload.shape().members else 0
        m.d.comb += [
            dark.eq(is_gated | cosine[-1] | ~cosine.any()),
            diffuse.i.payload.eq(given.cosine),
            specular.i.payload.operand.eq(given.highlight),
            specular.i.payload.dark.eq(0 if self.skips_dark else dark),
        ]
        for name in self._forwarded:
            wiring.connect(m, wiring.flipped(getattr(self, name)), getattr(specular, name))
        if self.exponent is not None and self._has_constants:
            # The light's exponent is fixed, but its specular unit has a port for the exponent.
            m.d.comb += specular.constants.exponent.eq(self.exponent)
        elif "constants" in self.signature.members:
            m.d.comb += copy(specular.constants, self.constants)
        if self.skips_dark:
            self._skip(m, diffuse, specular, given, dark, o)
            return m
        m.d.comb += [
            self.i.ready.eq(diffuse.i.ready),
            o.payload.diffuse.eq(diffuse.o.payload),
            o.payload.specular.eq(specular.o.payload),
            o.valid.eq(diffuse.o.valid),
        ]
        for unit in (diffuse, specular):
            m.d.comb += [unit.i.valid.eq(self.i.valid), unit.o.ready.eq(o.ready)]
        return m

    def _apply_factor(self, m: Module) -> stream.Interface:
        """Put the factor unit before the output. Returns the stream from which it takes the terms."""
        m.submodules.factor = factor = self._factor
        connect(m, factor.o, wiring.flipped(self.o))
        if self.fades:
            accepted, taken = self.i.valid & self.i.ready, factor.i.valid & factor.i.ready
            # Largest number of beats inside the units, including their outputs.
            most = self._depth + self._diffuse.latency + 1 if self.skips_dark else self._specular.latency + 1
            word = pass_beside(m, "factors", self.i.payload.factor, accepted, taken, most)
            m.d.comb += copy(factor.i.payload.factor, word)
        return factor.i

    @property
    def _depth(self) -> int:
        """Largest number of terms that wait for the specular unit.

        These are the terms inside the unit, a term that the unit is about to take, and a term for the output.
        """
        return max(self._specular.latency // self._specular.initiation_interval + 2, 3)

    def _skip(
        self,
        m: Module,
        diffuse: DiffuseUnit,
        specular: PipelinedUnit,
        given: data.View,
        dark: Value,
        o: stream.Interface,
    ) -> None:
        """Diffuse terms wait for the specular terms of their beats. A dark beat has no specular term."""
        depth = self._depth
        # A bit tells whether a beat is dark. The bit waits as long as the beat's term is in the diffuse unit
        # or in its FIFO.
        m.submodules.skips = skips = fifo.SyncFIFOBuffered(width=1, depth=depth + diffuse.latency)
        terms = diffuse.o.signature.create(path=("terms",))
        connect_fifo(m, "waiting", diffuse.o, terms, depth)
        takes, gives, skip = Signal(), Signal(), skips.r_data
        # A beat waits in a register, with a bit that tells whether it is dark.
        full, was_dark, taken = Signal(name="full"), Signal(name="was_dark"), Signal(name="taken")
        with m.If(~full):
            m.d.sync += [full.eq(self.i.valid), given.eq(self.i.payload), was_dark.eq(dark)]
        with m.Elif(taken):
            m.d.sync += full.eq(0)
        dark = was_dark
        m.d.comb += [
            self.i.ready.eq(~full),
            takes.eq(diffuse.i.ready & skips.w_rdy),
            taken.eq(full & takes & (dark | specular.i.ready)),
            specular.i.valid.eq(full & takes & ~dark),
            diffuse.i.valid.eq(full & skips.w_rdy & (dark | specular.i.ready)),
            skips.w_en.eq(taken),
            skips.w_data.eq(dark),
            o.valid.eq(terms.valid & skips.r_rdy & (skip | specular.o.valid)),
            gives.eq(o.valid & o.ready),
            terms.ready.eq(gives),
            skips.r_en.eq(gives),
            specular.o.ready.eq(gives & ~skip),
            o.payload.diffuse.eq(terms.payload),
            Value.cast(o.payload.specular).eq(Mux(skip, 0, Value.cast(specular.o.payload))),
        ]
