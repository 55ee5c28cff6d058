"""Framing: a core between streams of bytes, which mark the start and end of packets and frames."""

from amaranth.hdl import Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.byte_layout import ByteLayout
from blysk.golden.bus.framing import PACKETS, Framing
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.bus.byte_layout import bytes_of, fields_of, layout_of, misfits
from blysk.hdl.bus.tops import TOPS
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.triangles import COUNTER_BITS, count_events

__all__ = ["FramingUnit", "given_shape", "made_shape"]

_SETTLES = 3
"""Cycles from a beat that the core takes until the logic that watches the core has counted the beat."""


def given_shape(layout: ByteLayout) -> data.StructLayout:
    """Shape of an incoming beat: bytes, and whether it is the last beat of its frame."""
    return data.StructLayout({"data": data.ArrayLayout(8, layout.size), "last": 1})


def made_shape(layout: ByteLayout) -> data.StructLayout:
    """Shape of an outgoing beat: bytes, and flags: ``last`` of a packet, ``first`` and ``end`` of a frame."""
    return data.StructLayout({"data": data.ArrayLayout(8, layout.size), "last": 1, "first": 1, "end": 1})


class FramingUnit(wiring.Component):
    """A core between streams of bytes with the borders of frames. `Framing` is the bit-accurate model.

    A frame ends with a beat that has ``last``. No beat is accepted after it until the core is empty and the
    frame's last beat has been accepted at the output. So beats of two frames are never inside together, and
    constants can change in between. Each output beat is held back until the next beat comes or the frame
    ends. Only then does the unit know whether the beat is the last. This costs 2 cycles of latency, and no
    throughput. A frame without output gives no beat; ``frames`` counts it. Depths begin anew with each frame,
    unless the constant ``keep`` is 1. Then the frame adds to the picture of the frame before.

    Parameters
    ----------
    design : ShadingPipeline
        Design of the core. Its `Build` names the core (see `TOPS`).
    **options
        Keyword arguments of the core's constructor.

    Members
    -------
    i : :py:`In(stream.Signature(given_shape(layout)))`
        Spans or triangles.
    o : :py:`Out(stream.Signature(made_shape(layout)))`
        Pixels or spans.
    write, constants, memory
        Members of the core, if it has them. In place of ``picture`` the constants have ``keep``.
    status : :py:`Out(...)`
        Counters of the core, and three more fields:

        - ``frames``: number of ended frames;
        - ``misfits``: number of beats with a number that does not fit its field. The unit takes the low bits
          of the number. If the number is an index past the last material, the unit takes the last material;
        - ``busy``: a frame is inside.

    Source: docs/theory/bus.md#streams; not in the documents.
    """

    def __init__(self, design: ShadingPipeline | None = None, **options):
        design = design or ShadingPipeline()
        top = design.build.top
        self.top, self.packets = TOPS[top], PACKETS[top]
        self.core = self.top.unit(design, **options)
        payloads = self.core.i.payload.shape(), self.core.o.payload.shape()
        self._without = ("last",) if self.packets == "span" else ()
        below = {} if top == "geometry" else {"material": design.materials}
        multiple = (design.build.stream or 8) // 8
        given = layout_of(payloads[0], below=below, multiple=multiple)
        made = layout_of(payloads[1], self._without, multiple=multiple)
        self.model = Framing(given, made, self.packets)
        counters = {"frames": unsigned(COUNTER_BITS), "misfits": unsigned(COUNTER_BITS), "busy": unsigned(1)}
        members = {
            "i": In(stream.Signature(given_shape(given))),
            "o": Out(stream.Signature(made_shape(made))),
            "status": Out(data.StructLayout(self.core.status.shape().members | counters)),
        }
        of_core = self.core.signature.members
        members |= {name: of_core[name] for name in ("write", "memory") if name in of_core}
        if "constants" in of_core:
            constants = of_core["constants"].shape.members
            names = {name: "keep" if name == "picture" else name for name in constants}
            shape = data.StructLayout({names[name]: shape for name, shape in constants.items()})
            members["constants"] = In(shape)
        super().__init__(members)

    def elaborate(self, platform):
        """The core, the admission of beats, and the beat that is held back with its flags."""
        m = Module()
        m.submodules.core = core = self.core
        inside = self.top.watch(core)
        for name in ("write", "memory"):
            if name in self.signature.members:
                wiring.connect(m, wiring.flipped(getattr(self, name)), getattr(core, name))
        picture = None
        if "constants" in self.signature.members:
            given = {name: self.constants[name] for name in self.constants.shape().members}
            if "keep" in given:
                keep, given["picture"] = given.pop("keep"), (picture := Signal(name="picture"))
            m.d.comb += [core.constants[name].eq(value) for name, value in given.items()]

        active, ending, accept = Signal(name="active"), Signal(name="ending"), Signal(name="accept")
        settles = Signal(range(_SETTLES + 1), name="settles")
        shape, word = core.i.payload.shape(), Value.cast(self.i.payload.data)
        m.d.comb += [
            Value.cast(core.i.payload).eq(fields_of(shape, word)),
            core.i.valid.eq(self.i.valid & ~ending),
            self.i.ready.eq(core.i.ready & ~ending),
            accept.eq(self.i.valid & self.i.ready),
        ]
        if picture is not None:
            m.d.sync += picture.eq(picture ^ (accept & ~active & ~keep))
        with m.If(accept):
            m.d.sync += [active.eq(1), ending.eq(self.i.payload.last), settles.eq(_SETTLES)]
        with m.Elif(settles != 0):
            m.d.sync += settles.eq(settles - 1)
        empty, done = Signal(name="empty"), Signal(name="done")
        m.d.comb += empty.eq(ending & (settles == 0) & ~inside & ~core.o.valid)
        done_when = self._give(m, empty)
        m.d.comb += done.eq(done_when)
        with m.If(done):
            m.d.sync += [active.eq(0), ending.eq(0)]

        misfit = Signal(name="misfit")
        m.d.sync += misfit.eq(accept & misfits(self.model.given, word))
        count_events(m, self.status, frames=done, misfits=misfit)
        m.d.comb += [
            *copy_fields(self.status, core.status, core.status.shape().members),
            self.status.busy.eq(active),
        ]
        return m

    def _give(self, m: Module, empty: Value) -> Value:
        """Hold a beat back, and give the beat before it. Returns whether all beats of the frame have left."""
        made, shape = self.core.o, self.core.o.payload.shape()
        held, waiting = Signal(shape, name="held_back", reset_less=True), Signal(name="waiting")
        word, valid = Signal(self.o.payload.shape(), name="word", reset_less=True), Signal(name="valid")
        begun, leaves = Signal(name="begun"), Signal(name="leaves")
        if self.packets == "span":
            last = held.last
        elif self.packets == "run":
            place = made.payload
            last = empty | (place.x != held.x + 1) | (place.y != held.y)
        else:
            last = empty
        advance = skid_buffer(m, self.o, valid, word)
        done = empty & ~waiting & ~self.o.valid
        m.d.comb += [made.ready.eq(advance), leaves.eq(advance & waiting & (made.valid | empty))]
        with m.If(advance):
            m.d.sync += valid.eq(leaves)
            with m.If(made.valid):
                m.d.sync += [copy(held, made.payload), waiting.eq(1)]
            with m.Elif(empty):
                m.d.sync += waiting.eq(0)
        with m.If(leaves):
            m.d.sync += [
                Value.cast(word.data).eq(bytes_of(shape, Value.cast(held), self._without)),
                word.last.eq(last),
                word.first.eq(~begun),
                word.end.eq(empty),
                begun.eq(1),
            ]
        with m.If(done):
            m.d.sync += begun.eq(0)
        return done
