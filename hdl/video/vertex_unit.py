"""Vertex unit: a vertex times a matrix, its perspective division, and its place on the screen."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, Grid
from blysk.golden.number.fixed import SQ
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.video.motion import ENTRIES
from blysk.golden.video.vertex_unit import ENTRY, OFFSET, WEIGHT, VertexTransform
from blysk.hdl.core.accumulator import Accumulator, half
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy
from blysk.hdl.core.word import Word
from blysk.hdl.geometry.reciprocal import reciprocal_word, shared_table
from blysk.hdl.geometry.surface_words import surface_count
from blysk.hdl.geometry.wide_product import wide_product
from blysk.hdl.video.motion import entry_shape

__all__ = ["VertexUnit", "mesh_vertex_shape", "screen_vertex_shape"]

_SUM = SQ(6, 33)
"""Format of the sum of a row's products and an offset, all exact."""

_SHIFTED = 26
"""Fraction bits of a sum before it is shifted."""


def mesh_vertex_shape(index_bits: int, surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of a vertex of the mesh memory, with its index, and its attributes of a surface."""
    vertex = {"index": unsigned(index_bits), "position": normal_shape(), "normal": normal_shape()}
    if surface is not None:
        vertex["attributes"] = data.ArrayLayout(FixedShape(COMPONENT), surface.attributes)
    return data.StructLayout(vertex)


def screen_vertex_shape(grid: Grid = GRID, surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of `ScreenVertices.beats`."""
    words = data.ArrayLayout(FixedShape(ATTRIBUTE), surface_count(surface))
    return data.StructLayout(
        {
            "x": FixedShape(grid.coordinate),
            "y": FixedShape(grid.coordinate),
            "depth": FixedShape(DEPTH),
            "normal": data.ArrayLayout(FixedShape(ATTRIBUTE), 3),
            "outside": unsigned(1),
            **({} if surface is None else {"surface": words}),
        }
    )


class VertexUnit(PipelinedUnit):
    """Transforms vertices. `VertexTransform` is the bit-accurate model.

    The latency is the attribute ``latency``. There is one multiplier, and one adder for sums of products. So
    the initiation interval is `VertexTransform.cycles`.

    Parameters
    ----------
    model : VertexTransform
        Bit-accurate model.
    index_bits : int
        Bits of the index that goes with a vertex.

    Members
    -------
    i : :py:`In(stream.Signature(mesh_vertex_shape(index_bits, surface)))`
        Vertices of a mesh.
    o : :py:`Out(stream.Signature({"index", "vertex": screen_vertex_shape(grid, surface)}))`
        The same vertices on the screen.
    write : :py:`In(stream.Signature(entry_shape()))`
        Entries of the matrix, while no vertex is inside. They are accepted at once.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    def __init__(self, model: VertexTransform | None = None, index_bits: int = 9):
        self.model = model or VertexTransform()
        self._graph = Dataflow(self.model.cycles, merges=True)
        self._sums = Accumulator(self._graph)
        self._results = self._describe()
        surface = self.model.surface
        vertex = screen_vertex_shape(self.model.grid, surface)
        super().__init__(
            mesh_vertex_shape(index_bits, surface),
            data.StructLayout({"index": unsigned(index_bits), "vertex": vertex}),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=self.model.cycles,
            ports={"write": In(stream.Signature(entry_shape()))},
        )

    def _row(self, name: str, vector: Sequence[Word], first: int, begin=None) -> Word:
        """Sum in `_SUM` of the products of a vector and three entries of the matrix.

        ``begin`` makes the number with which the sum begins. By default it is half a step of `COMPONENT`.
        """
        g = self._graph
        products = []
        for k, component in enumerate(vector):
            entry = g.use(
                self._matrix,
                f"{name}_entry_{k}",
                (),
                lambda k=k: (first + k,),
                lambda found: found[0],
                since=2,
            )
            products.append(g.multiply(f"{name}_{k}", component, entry))
        begin = half(COMPONENT.fraction_bits) if begin is None else begin(products[0])
        return self._sums.sum(f"{name}_sum", products, _SUM, begin)

    def _entries(self, register, index: Value) -> tuple[FixedValue, FixedValue]:
        """The word of the matrix at an index: as entry, and as offset with half a step of X, Y and W."""
        port = self._memory.read_port(domain="comb")
        self._module.d.comb += port.addr.eq(index)
        below = self.model.SPACE.fraction_bits + 1 - OFFSET.fraction_bits
        rounded = SQ(OFFSET.integer_bits, OFFSET.fraction_bits + below)
        return (
            FixedValue(ENTRY, port.data[: ENTRY.width]),
            FixedValue(rounded, Cat(Const(1, below), port.data)),
        )

    def _describe(self) -> dict[str, Word]:
        """Words of the results."""
        g, p = self._graph, self.model
        position, normal = (
            [g.wire(f"{name}_{k}", lambda v, k=k: v[k], word) for k in range(3)]
            for name, word in (
                (name, g.input(name, lambda operands, name=name: operands[name]))
                for name in ("position", "normal")
            )
        )
        index = g.input("index", lambda operands: operands.index)
        places = p.SPACE.fraction_bits
        self._matrix = g.share("matrix", (unsigned((ENTRIES - 1).bit_length()),), 0, self._entries)

        # The rows come first, so that the products of a row come one after the other.
        def space(name, row):
            def begin(product):
                # The offset is read when the first product is there.
                return g.use(
                    *(self._matrix, f"{name}_offset", (), lambda: (9 + row,), lambda found: found[1]),
                    since=product,
                )

            return self._row(name, position, 3 * row, begin)

        w = g.register("w_word", lambda v: v.truncate(places).wrap(p.SPACE), space("w", 2))
        turned = [
            g.register(f"turned_{k}", _component, self._row(f"normal_{k}", normal, 12 + 3 * k))
            for k in range(3)
        ]
        totals = [space(name, row) for row, name in enumerate("xy")]
        outside, shift, r = self._reciprocal(w)
        words = {"index": index}
        for name, total in zip("xy", totals, strict=True):
            rounded = self._place(name, total, shift, r)
            words[name] = g.register(f"{name}_word", lambda value: value.saturate(p.place), rounded)
            words[f"{name}_over"] = g.register(f"{name}_over", self._over, rounded)
        words["outside"] = outside
        one = 1 << places
        words["depth"] = g.register(
            "depth", lambda r, s: (one - (Value.cast(r) >> s))[25 - DEPTH.width :][: DEPTH.width], r, shift
        )
        factor = g.register(
            "factor",
            lambda r: r.round_half_up(p.FACTOR_FORMAT.fraction_bits).wrap(p.FACTOR_FORMAT),
            r,
        )

        def over_w(name, scaled):
            rounded = self._sums.sum(f"{name}_scaled", [scaled], _SUM, half(_SHIFTED))
            words[name] = g.register(
                f"{name}_word",
                lambda v, s: _shifted(v, s)[_SHIFTED - ATTRIBUTE.fraction_bits :][: ATTRIBUTE.width],
                rounded,
                shift,
            )

        for k in range(3):
            over_w(f"normal_{k}", g.multiply(f"scaled_{k}", turned[k], factor))
        if p.surface is None:
            return words
        attributes = g.input("attributes", lambda operands: operands.attributes)
        for k in range(p.surface.attributes):
            attribute = g.wire(f"surface_{k}_given", lambda v, k=k: v[k], attributes)
            product = g.multiply(f"surface_{k}_scaled", attribute, factor)
            over_w(f"surface_{k}", product)
        weight = FixedValue(COMPONENT, Const(WEIGHT, COMPONENT.width).as_signed())
        product = g.multiply("weight_scaled", factor, factor, lambda _: weight)
        over_w(f"surface_{p.surface.attributes}", product)
        return words

    def _reciprocal(self, w: Word) -> tuple[Word, Word, Word]:
        """Whether W is outside, its shift, and the reciprocal of W after the shift."""
        g, p = self._graph, self.model
        places = p.SPACE.fraction_bits
        code = g.wire("w_code", lambda w: Value.cast(w), w)
        outside = g.register(
            "beyond", lambda c: c[-1] | ~c[places:-1].any() | c[places + p.SHIFTS + 1 : -1].any(), code
        )
        shift = g.register(
            "shift", lambda c: sum(c[places + k : places + p.SHIFTS + 1].any() for k in (1, 2, 3))[:2], code
        )

        def mantissa(c, shift, outside):
            # The first bit is 1 for every vertex, because a vertex outside gets W = 1.
            moved = (c >> Mux(outside, 0, shift))[:places]
            return FixedValue(Reciprocal.FORMAT, Cat(Mux(outside, 0, moved), Const(1, 1)))

        m = g.register("mantissa", mantissa, code, shift, outside)
        shift = g.register("shift_inside", lambda shift, outside: Mux(outside, 0, shift), shift, outside)
        table = shared_table(g, lambda: self._module)
        return outside, shift, reciprocal_word(g, table, "reciprocal", m)

    def _place(self, name: str, total: Word, shift: Word, r: Word) -> Word:
        """A place on the screen before it saturates, from X or Y and the reciprocal of W."""
        g, p = self._graph, self.model
        bits, point = p.SPACE.width, p.place.fraction_bits + p.GUARD
        moved = g.register(
            f"{name}_moved",
            lambda v, s: FixedValue(p.SPACE, _shifted(v, s)[_SHIFTED - p.SPACE.fraction_bits :][:bits]),
            total,
            shift,
        )
        return wide_product(
            *(g, f"{name}_rounded", moved, r, p.X_LOW, p.RECIPROCAL_LOW, point),
            lambda value: value.round_half_up(p.place.fraction_bits),
            self._sums,
        )

    def _over(self, rounded: FixedValue) -> Value:
        """Whether a coordinate saturates."""
        above = Value.cast(rounded)[self.model.place.width - 1 :]
        return above.any() & ~above.all()

    def datapath(self, m, operands):
        """Describe memory and registers of the graph, and read its results in the last stage."""
        self._module = m
        m.submodules.matrix = self._memory = Memory(shape=OFFSET.width, depth=ENTRIES, init=[])
        write = self._memory.write_port()
        m.d.comb += [
            write.addr.eq(self.write.payload.index),
            write.data.eq(Value.cast(self.write.payload.value)),
            write.en.eq(self.write.valid),
            self.write.ready.eq(1),
        ]
        read = self._graph.build(m, self, operands)
        value = {name: read(word, self.latency) for name, word in self._results.items()}
        result = Signal(self.o.payload.shape(), name="result")
        vertex = result.vertex
        m.d.comb += [
            result.index.eq(value["index"]),
            # A place counts from one edge of the picture to the other. Its code is in parts of a pixel.
            *(copy(vertex[name], value[name].scale(self.model.scale_bits)) for name in "xy"),
            Value.cast(vertex.depth).eq(value["depth"]),
            *(Value.cast(vertex.normal[k]).eq(value[f"normal_{k}"]) for k in range(3)),
            vertex.outside.eq(value["outside"] | value["x_over"] | value["y_over"]),
            *(
                Value.cast(vertex.surface[k]).eq(value[f"surface_{k}"])
                for k in range(surface_count(self.model.surface))
            ),
        ]
        return result


def _shifted(total: FixedValue, shift: Value) -> Value:
    """A sum, shifted right. All sums are in the same bits of the accumulator, so they share the shifter."""
    return Value.cast(total.truncate(_SHIFTED)) >> shift


def _component(total: FixedValue) -> FixedValue:
    """A component of a unit vector from a sum, clipped to -ONE and ONE."""
    code = Value.cast(total.truncate(COMPONENT.fraction_bits))
    clipped = Mux(code > ONE, ONE, Mux(code < -ONE, -ONE, code))
    return FixedValue(COMPONENT, clipped[: COMPONENT.width].as_signed())
