"""Plane setup: reciprocals of a triangle's height and width, for the steps of its attributes."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.geometry.edge_setup import plane_corners_shape
from blysk.hdl.geometry.reciprocal import reciprocal_word, shared_table
from blysk.hdl.geometry.wide_product import wide_product

__all__ = ["PlaneSetupUnit", "scales_shape"]


def scales_shape() -> dict:
    """Members of `PlaneScales.beats` that the gradient setup needs: all but ``sliver``."""
    walk = {
        name: shape for name, shape in plane_corners_shape().items() if name in ("fraction", "down", "along")
    }
    return {
        "height_reciprocal": FixedShape(Reciprocal.FORMAT),
        "knee": FixedShape(PlaneSetup.HEIGHT_FORMAT),
        "width_reciprocal": FixedShape(PlaneSetup.WIDTH_FORMAT),
        "row_shift": unsigned(PlaneSetup.SHIFT_BITS),
        "column_shift": unsigned(PlaneSetup.SHIFT_BITS),
        **walk,
        "right": unsigned(1),
    }


class PlaneSetupUnit(PipelinedUnit):
    """Reciprocals ``1/D`` and ``1/W`` of a triangle's height D and width W, as mantissas and exponents.

    `PlaneSetup` is the bit-accurate model. One shifter normalises height and area, and one table serves both
    reciprocals. Let I be the initiation interval. The seven multiplications take turns at ``ceil(7 / I)``
    multipliers of 18x18 bits. The latency, `latency`, follows from the schedule: 26 cycles for an interval of
    16.

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.
    initiation_interval : int
        Least number of cycles from a triangle to the next, at least 1. A number larger than the latency
        counts as the latency.
    skid : bool
        As in `PipelinedUnit`.

    Raises
    ------
    ValueError
        If the interval is less than 1.

    Members
    -------
    i : :py:`In(stream.Signature(plane_corners_shape(grid) with right))`
        Heights, area, and words that pass unchanged.
    o : :py:`Out(stream.Signature(scales_shape() with sliver))`
        Scales.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, grid: Grid = GRID, initiation_interval: int = 16, skid: bool = True):
        self.grid = grid
        self._graph = Dataflow(initiation_interval)
        self._results = self._describe()
        self.multipliers = self._graph.multiplier.count
        latency = max(word.stage for word in self._results.values())
        super().__init__(
            data.StructLayout(plane_corners_shape(grid) | {"right": unsigned(1)}),
            data.StructLayout(scales_shape() | {"sliver": unsigned(1)}),
            latency=latency,
            # A triangle that has left the unit shares no part of it with the next triangle.
            initiation_interval=min(initiation_interval, latency),
            skid=skid,
            stands=skid,
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, grid, p = self._graph, self.grid, PlaneSetup
        s, bits = grid.subpixel_bits, 2 * grid.bits
        point = Reciprocal.FORMAT.fraction_bits
        height, knee, area, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("long_height", "knee", "area", "right")
        )
        results = {
            name: g.input(name, lambda o, name=name: o[name]) for name in ("fraction", "down", "along")
        }

        # A word shifted left to its first 1, and the number of places. The steps are: find the bytes with a
        # 1, shift by bytes, shift by bits.
        def normalise(register, word):
            used = register(Cat(byte.any() for byte in _bytes(word)), "used")
            word = register(word, "given")
            place = Const(0, 3)
            for k in range(len(used)):
                place = Mux(used[k], len(used) - 1 - k, place)[:3]
            word = register((word << Cat(Const(0, 3), place))[:bits], "coarse")
            place, moved = register(place, "place"), []
            for step in (4, 2, 1):
                word, moved = _move(word, step, moved)
            return data.View(shifted, register(Cat(word, *reversed(moved), place), "shifted"))

        shifted = data.StructLayout({"word": unsigned(bits), "places": unsigned(6)})
        shifter = g.share("shifter", (unsigned(bits),), 3, normalise)
        top = g.use(shifter, "height_moved", (height,), lambda h: (Cat(Const(0, grid.bits), h),))
        wide = g.use(shifter, "area_moved", (area,), lambda a: (a,))
        # The shifter holds a result for one cycle only. A register keeps the result for more cycles.
        top, wide = (g.register(f"{w.name}_kept", lambda v: v, w) for w in (top, wide))

        def mantissa(view):
            # As many of the first bits of a word as the format has.
            return FixedValue(Reciprocal.FORMAT, _resized(view.word, bits, point + 1))

        d = g.wire("mantissa", mantissa, top)
        knee = g.register(
            "knee_word",
            lambda knee, top: FixedValue(
                p.HEIGHT_FORMAT,
                _resized((knee << top.places[:5])[: grid.bits], grid.bits, p.HEIGHT_FORMAT.width),
            ),
            knee,
            top,
        )
        table = shared_table(g, lambda: self._module)
        of_height = reciprocal_word(g, table, "height_reciprocal", d)
        of_area = reciprocal_word(g, table, "area_reciprocal", g.wire("area_mantissa", mantissa, wide))
        short = g.wire("height_mantissa", lambda d: d.truncate(p.HEIGHT_FORMAT.fraction_bits), d)
        ratio = wide_product(
            g,
            "ratio",
            short,
            of_area,
            p.HEIGHT_LOW,
            p.RECIPROCAL_LOW,
            point,
            lambda r: r.wrap(Reciprocal.FORMAT),
        )
        sliver = g.register("sliver", lambda a, h: (a << (8 - s)) <= h, area, height)

        def width(ratio, sliver):
            code = Value.cast(ratio)
            kept = Mux(code[point], code[1:], code[:point])
            return FixedValue(p.WIDTH_FORMAT, Mux(sliver, 0, kept)[:point])

        # These are e and g of `PlaneSetup`. On a grid of 8 fraction bits, e is 19 minus the places of the
        # height, and g is 39 minus the places of the area.
        row = g.register("row_shift", lambda top: (8 - s + grid.bits - 1 - top.places)[: p.SHIFT_BITS], top)
        column = g.register(
            "column_shift",
            lambda top, wide, ratio: (
                8 - s + grid.bits + top.places - wide.places - Value.cast(ratio)[point]
            )[: p.SHIFT_BITS],
            top,
            wide,
            ratio,
        )
        return results | {
            "height_reciprocal": of_height,
            "knee": knee,
            "width_reciprocal": g.register("width_reciprocal", width, ratio, sliver),
            "row_shift": row,
            "column_shift": column,
            "right": right,
            "sliver": sliver,
        }

    def datapath(self, m: Module, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        self._module = m
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape(), name="result")
        for name, word in self._results.items():
            m.d.comb += result[name].eq(value(word, self.latency, 1 + self.stands))
        return result


def _bytes(word: Value) -> list[Value]:
    return [word[k : k + 8] for k in range(0, len(word), 8)]


def _move(word: Value, step: int, moved: list) -> tuple[Value, list]:
    """Shift left by ``step`` places if the first ``step`` bits are 0.

    A bit is appended to ``moved``. It is 1 if the word was shifted.
    """
    empty = ~word[-step:].any()
    return Mux(empty, (word << step)[: len(word)], word), [*moved, empty]


def _resized(code: Value, bits: int, wanted: int) -> Value:
    """First ``wanted`` bits of a word of ``bits`` bits, with zeros behind it if it is too short."""
    return code[bits - wanted : bits] if bits >= wanted else Cat(Const(0, wanted - bits), code)
