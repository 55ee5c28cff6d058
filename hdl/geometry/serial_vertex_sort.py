"""Vertex sort of the compact style: corners exchanged in turns, the area digit by digit."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, wiring

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.golden.reference.scene import BACK_FACES
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.surface_words import placement_of
from blysk.hdl.geometry.triangles import (
    corners_shape,
    count_events,
    first_centre,
    order_shape,
)
from blysk.hdl.geometry.vertex_sort import PAIRS, sort_members

__all__ = ["SerialVertexSortUnit"]

DIGIT_BITS = 4
"""Bits of a height that go into the area on each cycle."""


class SerialVertexSortUnit(wiring.Component):
    """Sorts corners, finds the area, and drops triangles. `VertexSort` without its test of centres is the
    bit-accurate model.

    One triangle is inside. Neighbouring corners are compared in three cycles, and their coordinates are
    exchanged a cycle later. Attributes are put in order later (`AttributeSerialiserUnit`). At
    the same time the triangle's box is compared with the picture. Then the unit sums
    ``a = (x1 - x0)(y2 - y0) - (x2 - x0)(y1 - y0)`` in n digits of four bits of the heights, from the first
    digit on. It takes two Booth digits of each product a cycle. Low triangles have fewer digits. Results are
    exact. The unit has no multipliers.

    On a grid of 1/256 pixel n depends on the scanlines of a box. It is 3 for up to 6 scanlines, 4 for up to
    126, 5 for up to 2046, and 6 for more. A triangle takes 5 cycles if its box is empty, else n + 9 cycles.
    If it is drawn, it also takes the cycles on which it is offered, at least one.

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

    multipliers, tested = 0, 0

    def __init__(self, grid: Grid = GRID, surface: AttributeSpans | None = None):
        self.grid, self.surface = grid, surface
        super().__init__(sort_members(grid, surface))

    def elaborate(self, platform):
        """The steps and the counters."""
        m = Module()
        corners = [Signal(_corner_shape(self.grid), name=f"corner_{k}") for k in range(3)]
        shape = corners_shape(self.grid, self.surface).items()
        attributes = Signal(
            data.StructLayout({name: words for name, words in shape if name not in "xy"}),
            name="attributes",
            reset_less=True,
        )
        material, odd = Signal.like(self.i.payload.material), Signal(name="odd")
        places = {
            name: Signal(shape, name=name, reset_less=True)
            for name, shape in placement_of(self.surface).items()
        }
        two_sided = Signal(name="two_sided")
        covered, leaves, digits = Signal(name="covered"), Signal(name="leaves"), Signal(3, name="digits")
        ends = Signal(name="area_ends")

        step = Signal(3, name="sort_step")
        given = self.i.payload
        enters = [
            step.eq(self.i.valid),
            material.eq(given.material),
            odd.eq(0),
            two_sided.eq(given.two_sided),
            *(copy(place, given[name]) for name, place in places.items()),
            *copy_fields(attributes, given),
        ]
        with m.Switch(step):
            with m.Case(0):
                m.d.sync += enters
            with m.Case(4):
                m.d.sync += step.eq(Mux(covered, 5, 0))
            with m.Case(5):
                m.d.comb += leaves.eq(1)
                m.d.sync += step.eq(6)
            with m.Case(6), m.If(ends):
                m.d.sync += step.eq(0)
            with m.Default():
                m.d.sync += step.eq(step + 1)
        takes = step == 0
        m.d.comb += self.i.ready.eq(takes)
        order = self._exchange(m, corners, odd, step, takes)
        self._box(m, corners, order, step, covered, digits)
        tag = material, two_sided, places, attributes
        zero, culled = self._area(m, corners, tag, odd, digits, leaves, ends)
        count_events(m, self.status, empty=(step == 4) & ~covered, zero_area=zero, culled=culled)
        return m

    def _exchange(self, m: Module, corners: list, odd: Signal, step: Signal, takes: Value) -> list[Signal]:
        """Take corners in, and exchange neighbours that are in the wrong order.

        Returns the comparisons of `PAIRS`. On the second cycle these are the comparisons of the corners in
        the given order.

        Corners 0 and 1 are exchanged first, then 1 and 2, then 0 and 1 again. All three pairs are compared on
        the first cycle, before any exchange. The exchanges so far decide which comparison the next exchange
        needs.
        """
        turn, same, other = (Signal(name=name) for name in ("turn", "same", "other"))
        # The sign bit of x is inverted, so that y and x together are one signed number.
        columns = [Value.cast(corner.x) for corner in corners]
        key = [
            Cat(x[:-1], ~x[-1], Value.cast(corner.y)).as_signed()
            for x, corner in zip(columns, corners, strict=True)
        ]
        # ``same`` and ``other`` compare the last corner with the second corner and with the first corner.
        with m.If(step == 1):
            # A subtraction gets a carry chain. The mapper would make look-up tables of a comparison.
            for flag, (upper, lower) in zip((turn, same, other), PAIRS, strict=True):
                m.d.sync += flag.eq((key[lower] - key[upper])[-1])
        with m.Elif(step == 2):
            m.d.sync += [turn.eq(Mux(turn, other, same)), other.eq(Mux(turn, same, other))]
        with m.Else():
            m.d.sync += turn.eq(turn & other)
        outer, inner = (step == 2) | (step == 4), step == 3
        with m.If(turn & (outer | inner)):
            m.d.sync += odd.eq(~odd)
        first, second, third = (Value.cast(corner) for corner in corners)
        following = second, Mux(inner, third, first), second
        given = self.i.payload
        moving = outer, outer | inner, inner
        for k, (corner, neighbour, moves) in enumerate(zip(corners, following, moving, strict=True)):
            taken = Cat(Value.cast(given.x[k]), Value.cast(given.y[k]), Const(k, 2))
            with m.If(takes | (turn & moves)):
                m.d.sync += Value.cast(corner).eq(Mux(takes, taken, neighbour))
        return [turn, same, other]

    def _box(
        self, m: Module, corners: list, order: list, step: Signal, covered: Signal, digits: Signal
    ) -> None:
        """Whether the box and the picture have a pixel's centre in common, and the digits of the height.

        The corners' order stands for the order of their centres. So the comparisons do not wait for the sums
        of `first_centre`.
        """
        frame, inside = self.constants, []
        columns = [Value.cast(corner.x).as_signed() for corner in corners]
        across = [Signal(name=f"across_{upper}_{lower}") for upper, lower in PAIRS]
        for flag, (upper, lower) in zip(across, PAIRS, strict=True):
            m.d.sync += flag.eq((columns[lower] - columns[upper])[-1])
        for name, first, end, flags in (
            ("x", frame.left, frame.right, across),
            ("y", frame.top, frame.bottom, order),
        ):
            centres = [Signal(signed(X_BITS), name=f"centre_{name}_{k}") for k in range(3)]
            for centre, corner in zip(centres, corners, strict=True):
                m.d.sync += centre.eq(first_centre(corner[name], self.grid))
            turn, same, other = flags
            low, high = (Signal(signed(X_BITS), name=f"{end}_{name}") for end in ("low", "high"))
            m.d.sync += [
                low.eq(Mux(turn, Mux(same, centres[2], centres[1]), Mux(other, centres[2], centres[0]))),
                high.eq(Mux(turn, Mux(other, centres[0], centres[2]), Mux(same, centres[1], centres[2]))),
            ]
            inside += [low < high, low < end, first < high]
        rows = high - low
        with m.If(step == 3):
            m.d.sync += [covered.eq(Cat(inside).all()), digits.eq(_largest_digits(self.grid))]
            for count in reversed(range(3, _largest_digits(self.grid))):
                with m.If(rows < _rows_of(count, self.grid)):
                    m.d.sync += digits.eq(count)

    def _area(self, m, corners, tag, odd, digits, leaves, ends) -> tuple[Value, Value]:
        """The area. Returns whether a triangle without area ends now, and whether a culled triangle
        ends now.

        ``tag`` has the index of the material, whether the triangle is two-sided, the place of its texture,
        and the attributes.
        """
        (material, is_two_sided, places, attributes), two_sided = tag, Signal(name="two_sided_area")
        grid, result = self.grid, self.o.payload
        members = corners_shape(grid, self.surface) | order_shape() | {"material": material.shape()}
        words = Signal(data.StructLayout(members | placement_of(self.surface)), name="sorted")
        total_bits, most = 2 * grid.bits + 1, _largest_digits(grid)
        total = Signal(signed(total_bits), name="total")
        left, busy, done, odd_area = Signal(3), Signal(name="busy"), Signal(name="done"), Signal()
        x, y = ([Value.cast(corner[name]) for corner in corners] for name in "xy")
        terms = []
        for k, (across, height) in enumerate(((1, 2), (2, 1))):
            width = Signal(signed(grid.bits + 1), name=f"width_{k}")
            # One more bit below is for the first Booth digit.
            rest = Signal(DIGIT_BITS * most + 1, name=f"rest_{k}")
            down = (y[height] - y[0])[: grid.bits]
            with m.If(leaves):
                m.d.sync += width.eq(x[across] - x[0])
                for count in range(3, most + 1):
                    with m.If(digits == count):
                        m.d.sync += rest.eq(Cat(Const(0, 1 + DIGIT_BITS * (most - count)), down))
            with m.Else():
                m.d.sync += rest.eq(rest << DIGIT_BITS)
            # The second product is subtracted: its digits have the other sign. The 1 of each negation is
            # added with the term, in bits of the total that are 0.
            (high, high_minus), (low, low_minus) = (
                _booth_digit(width, rest[-size:][:3], bool(k)) for size in (3, 5)
            )
            term = Signal(signed(grid.bits + DIGIT_BITS + 1), name=f"term_{k}")
            minus = Signal(2, name=f"minus_{k}")
            m.d.sync += [term.eq((high << 2) + low), minus.eq(Cat(low_minus, high_minus))]
            terms.append((term, minus))

        sums, drops = Signal(name="sums"), Signal(name="drops")
        m.d.sync += sums.eq(busy)
        with m.If(leaves):
            m.d.sync += [busy.eq(1), left.eq(digits - 1), total.eq(0)]
        with m.Elif(busy):
            m.d.sync += [left.eq(left - 1), busy.eq(left != 0)]
        kept = [
            *(odd_area.eq(odd), two_sided.eq(is_two_sided), words.material.eq(material)),
            *(copy(words[name][k], corners[k][name]) for name in "xy" for k in range(3)),
            *(words.top.eq(corners[0].index), words.bottom.eq(corners[2].index)),
            *copy_fields(words, attributes, attributes.shape().members),
            *(copy(words[name], place) for name, place in places.items()),
        ]
        m.d.comb += kept
        with m.If(sums):
            (first, a), (second, b) = terms
            ones = Cat(
                bit for pair in zip(a, b, strict=True) for bit in (pair[0] ^ pair[1], pair[0] & pair[1])
            )
            m.d.sync += total.eq(Cat(ones, total) + first + second)
        found, positive, zero = (Signal(name=name) for name in ("found", "positive", "zero"))
        flags = [positive.eq(~total[-1]), zero.eq(~total.any())]
        m.d.sync += [found.eq(sums & ~busy), done.eq(found), *flags]

        back = (positive & ~zero) ^ odd_area
        culls, flips = (self.constants.back_faces == BACK_FACES.index(name) for name in ("cull", "flip"))
        culled = back & culls & ~two_sided
        valid = Signal(name="valid")
        m.d.comb += drops.eq(zero | culled)
        m.d.comb += ends.eq((done & drops) | (valid & self.o.ready))
        area, right, flip = (Signal.like(result[name], name=name) for name in ("area", "right", "flip"))
        with m.If(done):
            m.d.sync += [
                valid.eq(~drops),
                area.eq(Mux(positive, total, -total)),
                right.eq(~positive),
                flip.eq(back & (flips | culls)),
            ]
        with m.Elif(self.o.ready):
            m.d.sync += valid.eq(0)
        m.d.comb += [
            self.o.valid.eq(valid),
            *copy_fields(result, words, words.shape().members),
            *(result.area.eq(area), result.right.eq(right), result.flip.eq(flip)),
        ]
        return done & zero, done & culled & ~zero


def _booth_digit(value: Value, bits: Value, negative: bool) -> tuple[Value, Value]:
    """Value times a Booth digit (`booth_term`), negated if ``negative``; without a carry.

    A negated multiple has inverted bits, so it is 1 too small. The second result tells where to add this 1.
    """
    low, middle, high = bits
    one, two = low ^ middle, (low == middle) & (middle != high)
    minus = ~high if negative else high
    size = Mux(two, value << 1, Mux(one, value, 0))
    return (size[:] ^ minus.replicate(len(size))).as_signed(), minus


def _corner_shape(grid: Grid) -> data.StructLayout:
    """Coordinates of a corner, and its index before the sort."""
    coordinate = FixedShape(grid.coordinate)
    return data.StructLayout({"x": coordinate, "y": coordinate, "index": unsigned(2)})


def _largest_digits(grid: Grid) -> int:
    """Digits of the largest height, with one bit for its sign."""
    return -(-(grid.bits + 1) // DIGIT_BITS)


def _rows_of(digits: int, grid: Grid) -> int:
    """Least number of scanlines for which a height may need more than ``digits`` digits."""
    return (1 << (DIGIT_BITS * digits - 1 - grid.subpixel_bits)) - 1
