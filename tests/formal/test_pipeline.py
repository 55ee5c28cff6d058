"""Proofs of the pipeline: a span goes to all of its sinks or to none; constants do not change while a span is
inside."""

import pytest
from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value

import blysk.hdl.lighting.colored_intensity
import blysk.hdl.lighting.light
import blysk.hdl.methods.interpolator
import blysk.hdl.pixel_shading
from blysk.golden.frame_constants import FIELDS_OF_A_FRAME
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.presets import preset
from blysk.hdl.core.memory import UNCOUNTED
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.frame_constants import FrameConstantsUnit
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import IntensityUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.pixel_shading import PixelShading

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken
from .stubs import short

pytestmark = pytest.mark.prove

NARROW = {"x_bits": 2, "y_bits": 1, "length_bits": 2}


class Line(InterpolatorUnit):
    """A stub of the interpolator: two bits of the left normal, plus 1 for each pixel and each light."""

    latency = 1

    @classmethod
    def setup_intervals(cls, model):
        return range(1, 2)

    def elaborate(self, platform):
        m = Module()
        span, code, advance = self.i.payload, Signal(2), Signal()
        active, ends = count_down(m, self.i.valid, span.length, advance)
        m.d.comb += self.i.ready.eq(advance & ends)
        with m.If(taken(self.i)):
            m.d.sync += code.eq(Value.cast(span.normal_left[0]))
        with m.Elif(advance):
            m.d.sync += code.eq(code + 1)
        operands = Signal(self.o.payload.shape())
        for index, light in enumerate(operands):
            words = (Value.cast(light[name]) for name in light.shape().members)
            m.d.comb += [word.eq((code + index)[:2]) for word in words]
        m.d.comb += advance.eq(skid_buffer(m, self.o, active, operands))
        return m


def diffuse(cosine, term):
    yield Value.cast(term).eq(Value.cast(cosine)[:2])


def specular(light, term):
    yield Value.cast(term).eq(Mux(light.dark, 0, Value.cast(light.operand)[:2]))


def colors(terms, color):
    kinds = terms.shape().members
    yield color.r.eq(Cat(Value.cast(term)[:2] for kind in kinds for term in terms[kind]))


def decisions(span, lit):
    yield Value.cast(lit).eq(Value.cast(span.normal_right[0]))


@pytest.fixture
def stubs(monkeypatch):
    """Make a pipeline with room for three spans, a `Line`, and units of one or two cycles that pass on
    codes."""

    def pipeline(model, style="throughput"):
        interval = 2 if style == "compact" else 1
        # Longer than the interval of a dark beat, so that the lights do not move in the same cycles.
        longer = 3 if style == "compact" else 1
        units = (
            (blysk.hdl.pixel_shading, DiffuseUnit, diffuse, 1, 1),
            # A light unit builds this unit with the latency of its specular unit.
            (blysk.hdl.lighting.light, DiffuseUnit, diffuse, 2, 1),
            (blysk.hdl.lighting.light, SpecularUnit, specular, 2, longer),
            (blysk.hdl.lighting.colored_intensity, IntensityUnit, colors, interval, interval),
            (blysk.hdl.methods.interpolator, HighlightGateUnit, decisions, 2, 2),
        )
        compact = short(IntensityUnit, colors, interval, interval)
        monkeypatch.setattr(blysk.hdl.lighting.colored_intensity, "CompactIntensityUnit", compact)
        for module, unit, *options in units:
            monkeypatch.setattr(module, unit.__name__, short(unit, *options))
        monkeypatch.setitem(InterpolatorUnit.UNITS, LinearInterpolator, Line)
        monkeypatch.setattr(ShadingPipelineUnit, "_waiting_spans", UNCOUNTED + 1)
        return ShadingPipelineUnit(model.built(style=style))

    return pipeline


def of_writes(model):
    """Claims on writes. A span is inside from its admission until its last pixel leaves.

    Two facts are assumed that `of_waiting_spans` and the proofs of the assembler show. A last pixel leaves
    only while a span is inside. The FIFO of coordinates and the assembler limit the number of spans.
    """
    h = Harness(unit := ShadingPipelineUnit(model))
    inside = Signal(6)
    admitted = taken(unit.i) & (unit.i.payload.length != 0)
    finished = taken(unit.o) & unit.o.payload.last
    h.m.d.sync += inside.eq(inside + admitted - finished)
    h.assume(~finished | inside.any())
    h.assume(inside <= unit._waiting_spans + unit._assembler.SPANS_INSIDE)
    h.claim(unit.write.ready == ~inside.any())
    h.claim(~(taken(unit.write) & taken(unit.i)))
    # This claim makes the proof inductive.
    counted = h.register("inside") + h.register("came") - h.register("went")
    h.claim((counted == inside) & (h.register("idle") == ~inside.any()))
    return h


def of_constants():
    """Claim without lights: a pixel's colour is that of the last write before its span was taken."""
    h = Harness(unit := ShadingPipelineUnit(preset(model="cosquad", lights=0, grey=True, **NARROW)))
    ambient, (address, _) = Signal(17), FIELDS_OF_A_FRAME["ambient"]
    write = unit.write.payload
    with h.m.If(taken(unit.write) & (write.address == address)):
        h.m.d.sync += ambient.eq(write.data)
    rounded = (ambient + 32) >> 6
    h.claim(~unit.o.valid | (unit.o.payload.r == Mux(rounded > 255, 255, rounded)))
    return h


def of_waiting_spans(unit, late):
    """Claims on pixels, on spans that the interpolator takes, and on the time until an answer.

    No span is taken while a write is offered, and no write while a span is inside. Until the span or the
    write is taken, pixels leave. So it is taken in the end.
    """
    h = Harness(unit)
    span, model = unit.i.payload, unit.model

    def image(span, place, last, pixel):
        right = (pixel.x == (span.x + place)[:2]) & (pixel.y == span.y) & (pixel.last == last)
        if not model.lights:
            return right
        codes = [(Value.cast(span.normal_left[0]) + place + k)[:2] for k in range(model.lights)]
        lit = Value.cast(span.normal_right[0]) if model.gate else Const(-1, model.lights)
        terms = (
            codes
            if model.model is None
            else [*codes, *(Mux(lit[k], code, 0) for k, code in enumerate(codes))]
        )
        return right & (pixel.r == Cat(terms))

    stays(h, unit.o)
    capacity = 3 * (unit._waiting_spans + unit._assembler.SPANS_INSIDE)
    owed = pixels_follow(h, unit.i, unit.o, span.length, capacity, image)
    # Pixels that are inside leave first.
    leaves = taken(unit.o)
    answers(h, owed.any(), leaves, late, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready | leaves, late, unit.o.ready & ~unit.write.valid)
    answers(h, unit.write.valid, unit.write.ready | leaves, late, unit.o.ready)
    h.claim(~(unit.write.valid & taken(unit.i)))
    if model.lights:
        h.claim(taken(unit._interpolator.i) == (taken(unit.i) & (span.length != 0)))
    for light in unit._shading.lights[1:]:
        h.claim(taken(light.i) == taken(unit._shading.lights[0].i))
    return h


AMBIENT = preset(model="cosquad", lights=0, grey=True, **NARROW)
LINEAR = preset(method="linear", model=None, grey=True, **NARROW)
GATED = preset(method="linear", model="cosquad", exponent=10, gate=True, grey=True, **NARROW)
LIT = preset(method="linear", model="cosquad", exponent=10, grey=True, **NARROW)
TWO_LIGHTS = preset(method="linear", model="cosquad", exponent=10, grey=True, lights=2, **NARROW)


@pytest.mark.parametrize("model", [AMBIENT, LINEAR, GATED], ids=["ambient", "linear", "gated"])
def test_writes_wait_for_spans(prove, model):
    """By induction: a write is taken exactly when no span is inside, and never together with a span."""
    prove(of_writes(model))


def test_constants_stay(prove):
    """In 16 cycles with one channel: each pixel has the colour of the last write before its span was
    taken."""
    prove(of_constants(), 16)


# For each pipeline: the most cycles that a ready output waits, and the cycles of the proof.
PIPELINES = {
    "ambient": (AMBIENT, "throughput", 6, 14),
    "diffuse": (LINEAR, "throughput", 6, 16),
    "lit": (LIT, "throughput", 6, 14),
    "gated": (GATED, "throughput", 10, 20),
    "compact": (TWO_LIGHTS, "compact", 8, 16),
    "compact-gated": (GATED, "compact", 13, 24),
}


@pytest.mark.parametrize("name", PIPELINES)
def test_pixels(prove, stubs, name):
    """Within some cycles, for spans of 0 to 3 pixels and with `stubs`: all pixels leave in order and once
    each.

    Every span that is taken goes to the interpolator and to all units beside it. So each pixel has its
    position and its colour, and the last pixel of a span is marked. Every answer comes in time, also that to
    a waiting write.
    """
    *pipeline, late, cycles = PIPELINES[name]
    prove(of_waiting_spans(stubs(*pipeline), late), cycles)


BUGS = {
    "coordinates of another row": (
        "diffuse",
        "_carry_coordinates",
        "copy_fields(source.payload, self.i.payload, layout.members)",
        "(source.payload[k].eq(self.i.payload[k] ^ (k == 'y')) for k in layout.members)",
    ),
    "the interpolator takes what waits": (
        "diffuse",
        "_admit",
        "others, nonempty & unlocked",
        "others, nonempty",
    ),
    "coordinates are lost": (
        "diffuse",
        "_carry_coordinates",
        "return source.valid, source.ready",
        "return source.valid, 1",
    ),
    "spans overtake a write": ("ambient", "_admit", "unlocked.eq(~write_waits & ", "unlocked.eq("),
    "a light takes what the other does not": (
        "compact",
        "_connect_lights",
        "(other.i.ready for other in others)",
        "()",
    ),
    "a pixel passes the gate alone": (
        "gated",
        "_decide",
        "source.ready.eq(operands.ready & decisions.r_rdy)",
        "source.ready.eq(operands.ready)",
    ),
    "a decision is for a pixel": ("gated", "_decide", "last.eq(pixel == lengths.r_data - 1)", "last.eq(1)"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, stubs, bug):
    """Each bug, injected in the pipeline or its shading, refutes a claim within the cycles of the proof."""
    name, *change = BUGS[bug]
    *pipeline, late, cycles = PIPELINES[name]
    inject(PixelShading if change[0] == "_connect_lights" else ShadingPipelineUnit, *change)
    refute(of_waiting_spans(stubs(*pipeline), late), cycles)


WRITE_BUGS = {
    "constants change under a span": ("hold = ~idle", "hold = idle & ~idle"),
    "a write waits for ever": ("finished & is_one", "finished & ~is_one"),
    "a span is taken in beside a write": ("unlocked.eq(~write_waits & ", "unlocked.eq("),
    "the count forgets a span that came": ("Mux(went, 2, 0)", "Mux(went, 2, 1)"),
    "empty spans are counted": ("has_pixels = self.i.payload.length != 0", "has_pixels = self.i.valid"),
}


@pytest.mark.parametrize("bug", WRITE_BUGS)
def test_bugs_of_writes_are_found(refute, inject, bug):
    """Each bug, injected in `ShadingPipelineUnit`, refutes a claim on writes."""
    inject(ShadingPipelineUnit, "_admit", *WRITE_BUGS[bug])
    refute(of_writes(AMBIENT), 20)


CONSTANT_BUGS = {
    "constants change under a span": (
        ShadingPipelineUnit,
        "_admit",
        "hold = ~idle",
        "hold = idle & ~idle",
    ),
    "a write is kept before it is taken": (
        FrameConstantsUnit,
        "elaborate",
        "accepted if kind",
        "self.write.valid if kind",
    ),
}


@pytest.mark.parametrize("bug", CONSTANT_BUGS)
def test_bugs_of_constants_are_found(refute, inject, bug):
    """Each bug, injected in the pipeline or behind its write port, refutes the claim on colours."""
    owner, *change = CONSTANT_BUGS[bug]
    inject(owner, *change)
    refute(of_constants(), 16)
