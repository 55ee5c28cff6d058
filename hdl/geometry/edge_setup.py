"""Edge setup ([T] figure 4.10, increments): steps and start of an edge's walk, in integers."""

from dataclasses import dataclass

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.geometry.edge_setup import EDGES, FRACTION_BITS, X_BITS
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.edge_walk import walk_shape
from blysk.hdl.geometry.triangles import first_centre, tag_shape

__all__ = ["EdgeSetupUnit", "edge_corners_shape", "edges_shape", "plane_corners_shape"]

_DIVISORS = (0, "divisor"), (1, "triple")
"""For a divisor and its triple: k, and the name of the registers. These have 2 k bits more than a divisor."""

ALONG_BITS = 9
"""Bits of `Edges.along`, 0 to 511: 256 n minus b's fraction, which is over 0 if n is 2 (see `EdgeSetup`)."""


def edge_corners_shape(grid: Grid = GRID) -> data.StructLayout:
    """Shape of the input of the edge setup: sorted corners, twice the area, and the tag."""
    coordinate = data.ArrayLayout(FixedShape(grid.coordinate), 3)
    return data.StructLayout(
        {"x": coordinate, "y": coordinate, "area": unsigned(2 * grid.bits)} | tag_shape()
    )


def plane_corners_shape(grid: Grid = GRID) -> dict:
    """Members that the plane setup needs: heights, twice the area, and fraction and start of the walk."""
    return {
        "long_height": unsigned(grid.bits),
        "knee": unsigned(grid.bits),
        "area": unsigned(2 * grid.bits),
        "fraction": unsigned(FRACTION_BITS),
        "down": unsigned(8),
        "along": unsigned(ALONG_BITS),
    }


def edges_shape(grid: Grid = GRID) -> data.StructLayout:
    """Shape of `Edges.beats`: members of `walk_shape` and of `plane_corners_shape`."""
    return data.StructLayout({**walk_shape(grid).members, **plane_corners_shape(grid)})


@dataclass(frozen=True)
class _Ages:
    """Stages of an edge (`PipelinedUnit.at`): division loaded, start loaded, start done."""

    divide: int
    start: int
    done: int


class EdgeSetupUnit(PipelinedUnit):
    """Quotients, remainders and starts of three edges. `EdgeSetup` is the bit-accurate model.

    For each edge a non-restoring division of the difference in x by the height gives quotient and remainder.
    Then the start is computed from both, bit by bit. The division of the long edge goes on for the 32 bits
    of the fraction. Three dividers work on the edges of a triangle side by side. With one divider the edges
    take turns. On a grid of 1/256 pixel `latency` is 31 cycles with three dividers of two bits. It is 49 with
    one divider of two bits, and 79 with one divider of one bit. The unit has no multipliers.

    Parameters
    ----------
    grid : Grid
        Fraction bits s of the coordinates.
    dividers : int
        1 or 3.
    bits_per_cycle : int
        Quotient bits that a divider finds in a cycle: 1 or 2.
    initiation_interval : int or None
        Least number of cycles from a triangle to the next. ``None`` stands for the least possible interval,
        `least_interval`. With 1/256 pixel this is 16 for three dividers of two bits. It is 37 for one divider
        of two bits, and 67 for one divider of one bit.
    skid : bool
        As in `PipelinedUnit`.

    Raises
    ------
    ValueError
        If ``dividers`` or ``bits_per_cycle`` is another number, or the interval is too short.

    Members
    -------
    i : :py:`In(stream.Signature(edge_corners_shape(grid)))`
        Sorted corners.
    o : :py:`Out(stream.Signature(edges_shape(grid)))`
        Edges, and the words for the plane setup.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    def __init__(
        self,
        grid: Grid = GRID,
        dividers: int = 3,
        bits_per_cycle: int = 2,
        initiation_interval: int | None = None,
        skid: bool = True,
    ):
        if dividers not in (1, 3):
            raise ValueError(f"dividers must be 1 or 3, not {dividers!r}")
        if bits_per_cycle not in (1, 2):
            raise ValueError(f"bits_per_cycle must be 1 or 2, not {bits_per_cycle!r}")
        self.grid, self.dividers, self.bits_per_cycle = grid, dividers, bits_per_cycle
        steps = grid.bits // bits_per_cycle
        # A divider is loaded, takes its steps, and is read. Then the next edge has its turn.
        turn = max(steps, grid.subpixel_bits) + 2
        loads = [2 + (0 if dividers == 3 else k * turn) for k in range(3)]
        self._ages = [_Ages(load, load + steps + 2, load + steps + 4 + grid.subpixel_bits) for load in loads]
        fraction_read = self._ages[0].start + FRACTION_BITS // bits_per_cycle
        # The words from which an edge's start is computed stay in their registers for one interval. They are
        # read when the start is loaded.
        least = max(FRACTION_BITS // bits_per_cycle, len(loads) // dividers * turn, self._ages[-1].start - 1)
        interval = least if initiation_interval is None else initiation_interval
        if interval < least:
            raise ValueError(f"initiation_interval must be at least {least}, not {interval}")
        self.least_interval = least
        self._fraction_read = fraction_read
        last = max(self._ages[-1].done, fraction_read)
        super().__init__(
            edge_corners_shape(grid),
            edges_shape(grid),
            latency=last + 1,
            initiation_interval=interval,
            skid=skid,
            stands=skid,
        )

    def datapath(self, m, operands):
        """Differences, divisions, starts. Early results are kept until the last result is found."""
        grid = self.grid
        result = Signal(self.o.payload.shape())
        x, y = ([Value.cast(operands[name][k]) for k in range(3)] for name in "xy")

        def keep(value, name, age):
            # From stage `age` on, a word stays in its register for one interval. Copies keep the word up to
            # the stage `latency`.
            register = value
            while True:
                register = self.register(m, register, f"{name}_{age}", when=self.at(age))
                if age + self.initiation_interval >= self.latency + self.stands:
                    return register
                age = min(age + self.initiation_interval, self.latency - 1)

        edges = []
        for k, (top, bottom) in enumerate(EDGES):
            width = self.register(m, x[bottom] - x[top], f"width_{k}", when=self.at(1))
            down = (y[bottom] - y[top])[: grid.bits]
            height = self.register(m, down | (down == 0), f"height_{k}", when=self.at(1))
            begin = x[top] - grid.half
            begin = self.register(m, begin, f"begin_{k}", when=self.at(1))
            below = (grid.half - y[top])[: grid.subpixel_bits]
            below = self.register(m, below, f"below_{k}", when=self.at(1))
            edges.append((width, height, begin, below))

        copies = [[k] for k in range(3)] if self.dividers == 3 else [[0, 1, 2]]
        for number, members in enumerate(copies):
            self._divide(m, number, members, edges, result, keep)

        rows = [first_centre(value, grid) for value in y]
        for name, value in (
            ("first", rows[0]),
            ("upper", (rows[1] - rows[0])[:X_BITS]),
            ("flat", rows[1] == rows[0]),
            ("lower", (rows[2] - rows[1])[:X_BITS]),
            ("knee", (y[1] - y[0])[: grid.bits]),
            ("area", operands.area),
            ("down", Cat(Const(0, 8 - grid.subpixel_bits), edges[0][3])),
            *((name, operands[name]) for name in tag_shape()),
        ):
            early = name != "down"
            age = self.initiation_interval if early else 1 + self.initiation_interval
            m.d.comb += result[name].eq(keep(value, name, age))
        return result

    def _divide(self, m: Module, number: int, members: list[int], edges: list, result, keep) -> None:
        """A divider and the computation of the start behind it. Some edges share both in turns."""
        grid, ages = self.grid, [self._ages[k] for k in members]
        bits = grid.bits

        def chosen(values, moments):
            value = values[-1]
            for other, moment in zip(values[:-1], moments[:-1], strict=True):
                value = Mux(self.at(moment), other, value)
            return value

        # A remainder from -d to d - 1, and a word. The upper part of the word has the dividend bits to come.
        # The lower part has the quotient bits found so far.
        load = [age.divide for age in ages]
        rest, word = Signal(signed(bits + 1), name=f"rest_{number}"), Signal(bits, name=f"word_{number}")
        negative = Signal(name=f"negative_{number}")
        # Whether the next step subtracts: the remainder is not negative. As a register of its own this bit
        # needs no inverter, and the choice of the divisor's sign goes into the adder.
        subtracts = Signal(name=f"subtracts_{number}", init=1)
        divisor, triple = (Signal(bits + 2 * k, name=f"{name}_{number}") for k, name in _DIVISORS)
        width, height = (chosen([edges[k][part] for k in members], load) for part in range(2))
        loads = self.register(m, _any(self.at(age - 1) for age in load), f"loads_{number}")
        with m.If(loads):
            m.d.sync += [
                rest.eq(width[-1].replicate(bits + 1)),
                word.eq(width),
                negative.eq(width[-1]),
                subtracts.eq(~width[-1]),
                divisor.eq(height),
                triple.eq(height + (height << 1)),
            ]
        with m.Else():
            after, quotient = self._steps(subtracts, rest, word, divisor, triple)
            m.d.sync += [rest.eq(after), word.eq(quotient), subtracts.eq(after >= 0)]

        # The remainder is corrected, and gives the start.
        corrected = Mux(rest < 0, rest + divisor, rest)[:bits]
        quotient = Cat(word, negative).as_signed()
        read = [age.start - 1 for age in ages]
        found = self.register(m, _any(self.at(age - 1) for age in read), f"found_{number}")
        step = self.register(m, quotient, f"step_{number}", when=found)
        error_step = self.register(m, corrected, f"error_step_{number}", when=found)
        height = self.register(m, divisor, f"height_of_{number}", when=found)
        self._start(m, number, members, edges, (step, error_step, height), result, keep)
        if 0 in members:
            triple = self.register(m, triple, f"triple_of_{number}", when=found)
            fraction = self._fraction(m, error_step, height, triple)
            m.d.comb += result.fraction.eq(keep(fraction, "fraction", self._fraction_read))

    def _start(self, m, number, members, edges, division, result, keep) -> None:
        """``b`` and ``u`` of `EdgeSetup` are computed bit by bit, lowest first, and then x and the error."""
        grid, (step, error_step, height) = self.grid, division
        ages = [self._ages[k] for k in members]
        load = [age.start for age in ages]

        def chosen(values):
            value = values[-1]
            for other, moment in zip(values[:-1], load[:-1], strict=True):
                value = Mux(self.at(moment), other, value)
            return value

        s = grid.subpixel_bits
        total = Signal(signed(grid.bits + 1), name=f"total_{number}")
        carried = Signal(signed(grid.bits + 2), name=f"carried_{number}")
        both = self.register(m, error_step + height, f"both_{number}")
        below, low = Signal(s, name=f"below_of_{number}"), Signal(s, name=f"low_{number}")
        begin = Signal(signed(grid.bits + 1), name=f"begin_of_{number}")
        of_edge = [edges[k] for k in members]
        # Whether the next bit of the sum is 1.
        odd = Signal(name=f"odd_{number}")
        sum_ = total + Mux(below[0], step, 0)
        more = carried + Mux(below[0], Mux(odd, both, error_step), Mux(odd, height, 0))
        loads = self.register(m, _any(self.at(age - 1) for age in load), f"starts_{number}")
        with m.If(loads):
            first = chosen([edge[2] for edge in of_edge])
            m.d.sync += [
                begin.eq(first),
                total.eq(first[:s]),
                carried.eq(-1),
                below.eq(begin_below := chosen([edge[3] for edge in of_edge])),
                odd.eq(first[0] ^ (begin_below[0] & step[0])),
            ]
        with m.Else():
            m.d.sync += [
                total.eq(sum_ >> 1),
                carried.eq(more >> 1),
                below.eq(below >> 1),
                odd.eq(sum_[1] ^ (below[1] & step[0])),
                low.eq(Cat(low[1:], sum_[0])),
            ]
        more, less = carried + height, carried - height
        under, over = carried < 0, less >= 0
        places = Mux(under, 0, Mux(over, 2, 1))
        error = Mux(under, more, Mux(over, less, carried))[: grid.bits]
        # The column takes one cycle more than the error.
        whole = self.register(m, ((begin >> s) + total)[:X_BITS], f"whole_{number}")
        column = (whole + self.register(m, places, f"places_{number}"))[:X_BITS].as_signed()
        along = ((places << s) - low).as_signed() << (8 - s)
        for k, age in zip(members, ages, strict=True):
            for name, value in (
                ("x", column),
                ("error", error),
                ("step", step[:X_BITS].as_signed()),
                ("error_step", error_step),
                ("height", height),
            ):
                value = keep(value, f"{name}_{k}", age.done - (name != "x"))
                m.d.comb += result[name][k].eq(value)
                if k == 0 and name == "height":
                    m.d.comb += result.long_height.eq(value)
            if k == 0:
                along = keep(along[:ALONG_BITS], "along", age.done - 1)
                m.d.comb += result.along.eq(along)

    def _fraction(self, m: Module, error_step: Value, height: Value, triple: Value) -> Value:
        """The division of the long edge goes on: ``floor(2^32 error_step / height)``."""
        bits = self.grid.bits
        rest, word = (
            Signal(signed(bits + 1), name="fraction_rest"),
            Signal(FRACTION_BITS, name="fraction_word"),
        )
        divisors = [Signal(bits + 2 * k, name=f"fraction_{name}") for k, name in _DIVISORS]
        subtracts, nothing = Signal(name="fraction_subtracts", init=1), Const(0, FRACTION_BITS)
        after, quotient = self._steps(Const(1), error_step, nothing, height, triple)
        with m.If(self.at(self._ages[0].start)):
            m.d.sync += [rest.eq(after), word.eq(quotient), subtracts.eq(after >= 0)]
            m.d.sync += [divisors[0].eq(height), divisors[1].eq(triple)]
        with m.Else():
            after, quotient = self._steps(subtracts, rest, word, *divisors)
            m.d.sync += [rest.eq(after), word.eq(quotient), subtracts.eq(after >= 0)]
        return word

    def _steps(
        self, subtract: Value, rest: Value, word: Value, divisor: Value, triple: Value
    ) -> tuple[Value, Value]:
        """Make one or two steps of a division. Returns ``rest`` and ``word``.

        A step shifts a bit of ``word`` into ``rest``, and subtracts or adds the divisor. ``subtract`` is 1 if
        ``rest`` is not negative. The second step is computed from ``rest`` for both signs of the first
        result, with one or three times the divisor.
        """
        size = len(divisor) + 1

        def added(bits, less, more):
            # One adder does both. The 1 of a subtraction comes in through a bit below.
            number = Cat(bits, rest)[:size]
            less, more = (Cat(other, Const(0, 1))[:size] for other in (less, more))
            turned = Mux(subtract, ~less, more)
            return (Cat(Const(1, 1), number) + Cat(subtract, turned))[1 : size + 1].as_signed()

        first = added(word[-1:], divisor, divisor)
        positive = first >= 0
        if self.bits_per_cycle == 1:
            return first, Cat(positive, word[:-1])
        # If the first result is not negative, both steps subtract 3 divisors (`subtract`) or add 1. If it is
        # negative, both steps subtract 1 divisor (`subtract`) or add 3.
        down, up = added(word[-2:], triple, divisor), added(word[-2:], divisor, triple)
        second = Mux(positive, down, up).as_signed()
        return second, Cat(Mux(positive, down >= 0, up >= 0), positive, word[:-2])


def _any(values) -> Value:
    return Cat(*values).any()
