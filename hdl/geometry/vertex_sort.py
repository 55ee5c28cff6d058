"""Vertex sort ([T] figure 4.10): corners from top to bottom, orientation, and dropped triangles."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.golden.geometry.vertex_sort import FACTOR_BITS, TESTED
from blysk.golden.reference.scene import BACK_FACES
from blysk.hdl.core.memory import NEEDS_ZEROS, read_address, read_options, registered_read
from blysk.hdl.core.views import copy_fields
from blysk.hdl.geometry.centre_test import misses_centres, near_bits
from blysk.hdl.geometry.surface_words import placement_of
from blysk.hdl.geometry.triangles import (
    corners_shape,
    count_events,
    counters_shape,
    first_centre,
    frame_shape,
    in_order,
    order_shape,
    tag_shape,
    triangle_shape,
)

__all__ = ["PAIRS", "WAITING_TRIANGLES", "VertexSortUnit", "sort_members", "sorted_triangle_shape"]

PAIRS = (0, 1), (1, 2), (0, 2)
"""Pairs of corners that are compared: whether the second corner comes before the first."""

WAITING_TRIANGLES = 512
"""Words of the memory of triangles, in block RAMs.

Dropped triangles come in runs. Where a mesh shows its back, a run may have hundreds of triangles. During a
run the setup works on the waiting triangles.
"""

_KEPT = 16
"""Words of the memory of drawn triangles' results, in look-up tables."""

_RESERVED = 4
"""Words of the memory of triangles that stay free: writes that its level does not count yet, and one more."""


def sorted_triangle_shape(grid: Grid = GRID, surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of `SortedTriangles.beats`: corners, their order, twice the area, the tag, place of the texture.

    Only the coordinates are sorted.
    """
    area = {"area": unsigned(2 * grid.bits)}
    members = corners_shape(grid, surface) | order_shape() | area | tag_shape()
    return data.StructLayout(members | placement_of(surface))


def sort_members(grid: Grid, surface: AttributeSpans | None) -> dict[str, wiring.Member]:
    """Members of a vertex sort of any style, as `VertexSortUnit` has them."""
    return {
        "i": In(stream.Signature(triangle_shape(grid, surface))),
        "o": Out(stream.Signature(sorted_triangle_shape(grid, surface))),
        "constants": In(frame_shape()),
        "status": Out(counters_shape("empty", "zero_area", "culled")),
    }


class VertexSortUnit(wiring.Component):
    """Sorts corners, finds the area, and drops triangles. `VertexSort` is the bit-accurate model.

    A triangle is written into a memory when it comes. Only its coordinates go through a pipeline. The
    pipeline compares the corners, compares the box with the picture, and finds
    ``a = (x1 - x0)(y2 - y0) - (x2 - x0)(y1 - y0)`` from the corners in the given order. Results of drawn
    triangles wait in a second memory. A drawn triangle is read from the first memory, and a multiplexer
    puts its coordinates in order. Its attributes are put in order later, one after the other
    (`AttributeSerialiserUnit`). So a dropped triangle takes no other unit's time.

    The unit takes a triangle in each cycle, drawn or dropped. `VertexSort.cycles` has the exceptions: if a
    difference of coordinates is 512 pixels or more, each product takes four cycles, from the halves of its
    factors. The unit also waits while `WAITING_TRIANGLES` triangles, or 15 drawn triangles, wait in its
    memories. A drawn triangle is offered 11 cycles after it was taken in, or 14 cycles with four cycles for
    a product. The unit has six multipliers of 18x18 bits: two for a, and four for the test of centres
    (`misses_centres`).

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring.

    Members
    -------
    i : :py:`In(stream.Signature(triangle_shape(grid, surface)))`
        Triangles.
    o : :py:`Out(stream.Signature(sorted_triangle_shape(grid, surface)))`
        Drawn triangles.
    constants : :py:`In(frame_shape())`
        The frame, constant while triangles are inside.
    status : :py:`Out(counters_shape("empty", "zero_area", "culled"))`
        Number of triangles dropped for each reason, since the reset.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    multipliers, tested = 6, TESTED

    def __init__(self, grid: Grid = GRID, surface: AttributeSpans | None = None):
        self.grid, self.surface = grid, surface
        super().__init__(sort_members(grid, surface))

    def elaborate(self, platform):
        """The pipeline, the memories and the counters."""
        m, culls = Module(), self.constants.back_faces == BACK_FACES.index("cull")
        # ``goes``: results have room. Without room all stages stop. ``moves``: the first two stages take
        # their next triangles. They wait while a triangle needs more products.
        self._goes, self._moves = goes, moves = Signal(name="goes", init=1), Signal(name="moves")
        takes, room, given = Signal(name="takes"), Signal(name="room"), self.i.payload
        m.d.comb += [self.i.ready.eq(room & moves), takes.eq(self.i.valid & self.i.ready)]
        x, y = (
            [self._stage(m, Value.cast(given[axis][k]).as_signed(), f"{axis}_{k}", moves) for k in range(3)]
            for axis in "xy"
        )
        columns, rows = (
            [self._stage(m, v[b] - v[a], f"{axis}_{a}_{b}", moves) for a, b in PAIRS]
            for axis, v in (("x", x), ("y", y))
        )
        there = self._valid(m, self._valid(m, takes, 1, moves), 2, moves)
        two_sided = self._stage(
            m, self._stage(m, given.two_sided, "two_sided_1", moves), "two_sided_2", moves
        )
        wide = self._stage(m, self._wide([v[b] - v[0] for v in (x, y) for b in (1, 2)]), "wide", moves)
        total, last = self._total(m, (there, wide), [*columns[::2], *rows[::2]])
        m.d.comb += moves.eq(goes & (~there | last))
        there = self._valid(m, there & last, 3)

        # The order of x alone and of y alone is enough for the box. Corners at equal height are ordered by x.
        across, upwards = ([value[-1] for value in values] for values in (columns, rows))
        level = [row == 0 for row in rows]
        before = [
            self._stage(m, up | (flat & left), f"before_{a}_{b}")
            for up, flat, left, (a, b) in zip(upwards, level, across, PAIRS, strict=True)
        ]
        box, inside = zip(
            self._box(m, "x", x, across, ("left", "right")),
            self._box(m, "y", y, upwards, ("top", "bottom")),
            strict=True,
        )
        missed = self._missed(m, (x[0], y[0]), (columns, rows), (across, level, upwards), box, total)
        two_sided = self._stage(m, two_sided, "two_sided_3")
        tag = Cat(Cat(inside).all(), two_sided, before[0] ^ before[1] ^ before[2], *_ends(before, (0, 1, 2)))
        for number in range(4, 9):
            there, tag = self._valid(m, there, number), self._stage(m, tag, f"tag_{number}")
        covered, two_sided, odd, first, final = tag[0], tag[1], tag[2], tag[3:5], tag[5:7]

        negative, zero, area = total[-1], ~total.any(), Mux(total[-1], -total, total)[: 2 * self.grid.bits]
        for number in (7, 8):
            negative, zero, area = (
                self._stage(m, value, f"{name}_{number}")
                for name, value in (("negative", negative), ("zero", zero), ("area", area))
            )
        back, flips = ~(negative | zero), self.constants.back_faces == BACK_FACES.index("flip")
        culled, decides = back & culls & ~two_sided, there & goes
        found = Signal(self._found_shape(), name="found")
        m.d.comb += [
            *(found.top.eq(first), found.bottom.eq(final), found.area.eq(area)),
            *(found.right.eq(negative ^ odd), found.flip.eq(back & (flips | culls))),
        ]
        solid = covered & ~zero & ~culled
        self._keep(m, takes, room, decides, solid & ~missed, found)
        count_events(
            m,
            self.status,
            empty=decides & (~covered | (solid & missed)),
            zero_area=decides & covered & zero,
            culled=decides & covered & culled,
        )
        return m

    def _stage(self, m: Module, value: Value, name: str, enable: Value | None = None) -> Signal:
        """The value in a register of the next stage."""
        kept = Signal(value.shape(), name=name, reset_less=True)
        with m.If(self._goes if enable is None else enable):
            m.d.sync += kept.eq(value)
        return kept

    def _valid(self, m: Module, value: Value, number: int, enable: Value | None = None) -> Signal:
        """Whether a triangle is in the stage of this number."""
        kept = Signal(name=f"valid_{number}")
        with m.If(self._goes if enable is None else enable):
            m.d.sync += kept.eq(value)
        return kept

    def _missed(self, m: Module, corner: tuple, differences: tuple, signs: tuple, box: tuple, total: Value):
        """Whether the triangle of stage 8 has a box of 1 to 4 centres, and covers none (`misses_centres`)."""
        bits, (across, level, upwards) = near_bits(self.grid), signs

        def stage(value, name):
            return self._stage(m, value, name)

        corner = [
            stage(self._stage(m, code[:bits], f"corner_{axis}_2", self._moves), f"corner_{axis}_3")
            for axis, code in zip("xy", corner, strict=True)
        ]
        near = [
            stage(value[:bits], f"near_{axis}_{k}")
            for axis, values in zip("xy", differences, strict=True)
            for k, value in enumerate(values[::2])
        ]
        inclusive = [
            stage(Mux(flat, ~left, up), f"inclusive_{a}_{b}")
            for left, flat, up, (a, b) in zip(across, level, upwards, PAIRS, strict=True)
        ]
        return misses_centres(stage, self.grid, corner, near, inclusive, box, total)

    def _box(self, m: Module, axis: str, corners: list, order: list, ends: tuple[str, str]) -> tuple:
        """First column (scanline) and the first after the box in stage 3, and whether the picture has a part.

        The corners' order stands for the order of their centres. So the comparisons do not wait for the sums
        of `first_centre`.
        """
        centres = [
            self._stage(m, first_centre(corner, self.grid), f"centre_{axis}_{k}", self._moves)
            for k, corner in enumerate(corners)
        ]
        low, high = (
            self._stage(m, end.as_signed(), f"{name}_{axis}")
            for end, name in zip(_ends(order, centres), ("low", "high"), strict=True)
        )
        begin, end = (self.constants[name] for name in ends)
        return (low, high), Cat(low < high, low < end, begin < high).all()

    def _wide(self, differences: list) -> Value:
        """Whether a difference needs its upper half, so that the products need four parts."""
        if len(differences[0]) <= FACTOR_BITS:
            return Const(0, 1)
        ends = [value[FACTOR_BITS - 1 :] for value in differences]
        return Cat(end.any() & ~end.all() for end in ends).any()

    def _total(self, m: Module, kind: tuple, differences: list) -> tuple[Signal, Value]:
        """``a`` of stage 6 from differences of stage 2, and whether the triangle leaves stage 2.

        ``kind`` tells whether a triangle is in stage 2, and whether it is wide (`_wide`). Let h and l be the
        upper and the lower half of a difference, ``h 2^17 + l``. The four parts of a wide product are
        ``h h'``, ``h l'``, ``l h'`` and ``l l'``.
        """
        half, bits = FACTOR_BITS - 1, 2 * self.grid.bits + 1
        part, (there, wide) = Signal(2, name="part"), kind
        with m.If(there & wide & self._goes):
            m.d.sync += part.eq(part + 1)

        def factor(value, upper, name):
            if len(value) <= FACTOR_BITS:
                return self._stage(m, value, name)
            lower = Cat(value[:half], value[half] & ~wide).as_signed()
            return self._stage(m, Mux(upper & wide, value[half:].as_signed(), lower).as_signed(), name)

        x_01, x_02, y_01, y_02 = differences
        products = [
            self._stage(
                m,
                factor(wide_x, ~part[1], f"width_{k}") * factor(wide_y, ~part[0], f"height_{k}"),
                f"product_{k}",
            )
            for k, (wide_x, wide_y) in enumerate(((x_01, y_02), (x_02, y_01)))
        ]
        change = self._stage(m, products[0] - products[1], "change")
        total = Signal(signed(bits), name="total")
        # Parts 1 and 3 come after a shift. Part 0 begins a sum.
        begins, shifts = ~(part[0] | part[1]), part[0]
        for number in range(3, 6):
            begins, shifts = (
                self._stage(m, bit, f"{name}_{number}")
                for bit, name in ((begins, "begins"), (shifts, "shifts"))
            )
        sum_ = Mux(begins, 0, Mux(shifts, total.shift_left(half), total)[:bits])
        with m.If(self._goes):
            m.d.sync += total.eq(sum_ + change)
        return total, ~wide | part.all()

    def _found_shape(self) -> data.StructLayout:
        """Results of a drawn triangle: the order of the corners, the tag, twice the area."""
        flags = {"right": unsigned(1), "flip": unsigned(1)}
        return data.StructLayout(order_shape() | flags | {"area": unsigned(2 * self.grid.bits)})

    def _keep(self, m: Module, takes: Value, room: Signal, decides: Value, drawn: Value, found) -> None:
        """The memories of triangles and of results, and the output."""
        given, shown = self.i.payload, self.o.payload
        members = corners_shape(self.grid, self.surface)
        rest = {"material": given.material.shape(), **placement_of(self.surface)}
        layout = data.StructLayout(members | rest)
        triangle, bits = Signal(layout, name="triangle"), (WAITING_TRIANGLES - 1).bit_length()
        m.submodules.triangles = triangles = Memory(shape=layout.size, depth=1 << bits, init=[])
        shape = bits + found.shape().size
        m.submodules.results = results = Memory(shape=shape, depth=_KEPT, init=[], attrs=NEEDS_ZEROS)
        written, kept = triangles.write_port(), results.write_port()
        head = results.read_port(**read_options(results))
        free, decided, oldest = (Signal(bits, name=name) for name in ("free", "decided", "oldest"))
        behind, first, level = (Signal.like(kept.addr, name=name) for name in ("behind", "first", "level"))
        slot, some, reads = head.data[:bits], level != 0, Signal(name="reads")
        m.d.comb += [
            *copy_fields(triangle, given),
            *(written.addr.eq(free), written.data.eq(triangle), written.en.eq(takes)),
            *(kept.addr.eq(behind), kept.data.eq(Cat(decided, found)), kept.en.eq(decides & drawn)),
            *(head.addr.eq(read_address(first, first + reads)), level.eq(behind - first)),
        ]
        # Levels are one cycle old.
        m.d.sync += [
            *(free.eq(free + takes), decided.eq(decided + decides), behind.eq(behind + kept.en)),
            self._goes.eq(level < _KEPT - 2),
            oldest.eq(Mux(some, slot, decided)),
            room.eq((free - oldest)[:bits] < WAITING_TRIANGLES - _RESERVED),
        ]

        read, offered = Signal(name="read"), Signal(name="offered")
        wanted = ~offered | self.o.ready
        word, steps = registered_read(m, triangles, slot, wanted, written)
        # ``reads`` implies ``steps``, because the slot of a waiting triangle is not written.
        m.d.comb += reads.eq(wanted & some)
        coming, leaving = (
            Signal(found.shape(), name=name, reset_less=True) for name in ("coming", "leaving")
        )
        with m.If(reads):
            m.d.sync += first.eq(first + 1)
        with m.If(steps):
            m.d.sync += [
                *(read.eq(reads), offered.eq(read)),
                *(coming.eq(head.data[bits:]), leaving.eq(coming)),
            ]
        with m.Elif(self.o.ready):
            m.d.sync += offered.eq(0)
        stored = data.View(layout, word)
        m.d.comb += [
            self.o.valid.eq(offered),
            *copy_fields(shown, stored, [name for name in layout.members if name not in "xy"]),
            *copy_fields(shown, leaving, found.shape().members),
        ]
        for name in "xy":
            for to, word in zip(
                shown[name], in_order(leaving.top, leaving.bottom, stored[name]), strict=True
            ):
                m.d.comb += Value.cast(to).eq(word)


def _ends(before: Sequence, values: Sequence) -> tuple[Value, Value]:
    """The first and the last of three values. ``before`` has the comparisons of `PAIRS`."""
    turn, same, other = before
    return (
        Mux(turn, Mux(same, values[2], values[1]), Mux(other, values[2], values[0])),
        Mux(turn, Mux(other, values[0], values[2]), Mux(same, values[1], values[2])),
    )
