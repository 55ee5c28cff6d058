"""Vertex unit: a vertex times a matrix, its perspective division, and its place on the screen."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, Grid
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.video.vertex_unit import ENTRY, OFFSET, WEIGHT, VertexTransform
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy
from blysk.hdl.core.word import Word
from blysk.hdl.geometry.reciprocal import reciprocal_word, shared_table
from blysk.hdl.geometry.surface_words import surface_count
from blysk.hdl.geometry.wide_product import wide_product

__all__ = ["VertexUnit", "matrix_shape", "mesh_vertex_shape", "screen_vertex_shape"]


def matrix_shape() -> data.StructLayout:
    """Shape of `Matrix.codes`."""
    rows = data.ArrayLayout(data.ArrayLayout(FixedShape(ENTRY), 3), 3)
    return data.StructLayout(
        {"position": rows, "offset": data.ArrayLayout(FixedShape(OFFSET), 3), "normal": rows}
    )


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

    The latency is the attribute ``latency``. With one multiplier the initiation interval is
    `VertexTransform.cycles`.

    Parameters
    ----------
    model : VertexTransform
        Bit-accurate model.
    index_bits : int
        Bits of the index that goes with a vertex.
    initiation_interval : int, optional
        Cycles from a vertex to the next, 15 or more. An interval of 15 takes two multipliers. By default
        those of one multiplier.

    Members
    -------
    i : :py:`In(stream.Signature(mesh_vertex_shape(index_bits, surface)))`
        Vertices of a mesh.
    o : :py:`Out(stream.Signature({"index", "vertex": screen_vertex_shape(grid, surface)}))`
        The same vertices on the screen.
    constants : :py:`In(matrix_shape())`
        The matrix, constant while vertices are inside.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    def __init__(
        self,
        model: VertexTransform | None = None,
        index_bits: int = 9,
        initiation_interval: int | None = None,
    ):
        self.model = model or VertexTransform()
        initiation_interval = initiation_interval or self.model.cycles
        if initiation_interval < 15:
            raise ValueError(f"initiation_interval must be at least 15, not {initiation_interval}")
        self._graph = Dataflow(initiation_interval)
        self._results = self._describe()
        self.multipliers = self._graph.multiplier.count
        surface = self.model.surface
        vertex = screen_vertex_shape(self.model.grid, surface)
        super().__init__(
            mesh_vertex_shape(index_bits, surface),
            data.StructLayout({"index": unsigned(index_bits), "vertex": vertex}),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            constants=matrix_shape(),
        )

    def _rows(self, name: str, vector: Word, row: int, finish) -> Word:
        """Multiply a matrix's row and a vector, sum the products, and apply ``finish``."""
        g, matrix = self._graph, name.split("_")[0]
        products = [
            g.multiply(
                f"{name}_{k}",
                vector,
                vector,
                lambda v, k=k: v[k],
                lambda _, k=k: getattr(self.constants, matrix)[row][k],
            )
            for k in range(3)
        ]
        partial = g.register(f"{name}_partial", lambda a, b: a + b, *products[:2])
        return g.register(f"{name}_total", lambda a, b: finish(a, b), partial, products[2])

    def _describe(self) -> dict[str, Word]:
        """Words of the results."""
        g, p = self._graph, self.model
        position, normal = (
            g.input(name, lambda operands, name=name: operands[name]) for name in ("position", "normal")
        )
        index = g.input("index", lambda operands: operands.index)
        places, bits = p.SPACE.fraction_bits, p.SPACE.width

        def space(row):
            def finish(partial, last):
                total = (partial + last) + self.constants.offset[row]
                return total.round_half_up(places).wrap(p.SPACE)

            return finish

        w = self._rows("position_w", position, 2, space(2))
        x, y = (self._rows(f"position_{name}", position, row, space(row)) for row, name in enumerate("xy"))
        code = g.register("w_held", lambda w: Value.cast(w), w)
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
        r = reciprocal_word(g, table, "reciprocal", m)
        words = {"index": index}
        for name, value in (("x", x), ("y", y)):
            moved = g.register(
                f"{name}_moved",
                lambda v, s: FixedValue(p.SPACE, (Value.cast(v) >> s)[:bits].as_signed()),
                value,
                shift,
            )
            product = wide_product(
                g,
                f"{name}_place",
                moved,
                r,
                p.X_LOW,
                p.RECIPROCAL_LOW,
                p.place.fraction_bits + p.GUARD,
                lambda value: value,
            )
            rounded = g.register(
                f"{name}_rounded", lambda value: value.round_half_up(p.place.fraction_bits), product
            )
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

        def over_w(name, scaled, read):
            rounded = g.register(f"scaled_{name}_rounded", lambda v: v.round_half_up(26), scaled)
            words[read] = g.register(
                f"{read}_word",
                lambda v, s: (Value.cast(v) >> s)[26 - ATTRIBUTE.fraction_bits :][: ATTRIBUTE.width],
                rounded,
                shift,
            )

        for k in range(3):
            turned = self._rows(f"normal_{k}", normal, k, _component)
            over_w(k, g.multiply(f"scaled_{k}", turned, factor), f"normal_{k}")
        if p.surface is None:
            return words
        attributes = g.input("attributes", lambda operands: operands.attributes)
        for k in range(p.surface.attributes):
            product = g.multiply(f"surface_{k}_scaled", attributes, factor, lambda v, k=k: v[k])
            over_w(f"surface_{k}", product, f"surface_{k}")
        weight = FixedValue(COMPONENT, Const(WEIGHT, COMPONENT.width).as_signed())
        product = g.multiply("weight_scaled", factor, factor, lambda _: weight)
        over_w("weight", product, f"surface_{p.surface.attributes}")
        return words

    def _over(self, rounded: FixedValue) -> Value:
        """Whether a coordinate saturates."""
        above = Value.cast(rounded)[self.model.place.width - 1 :]
        return above.any() & ~above.all()

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        self._module = m
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


def _component(partial: FixedValue, last: FixedValue) -> FixedValue:
    """A component of a unit vector from a sum, clipped to -ONE and ONE."""
    value = (partial + last).round_half_up(COMPONENT.fraction_bits)
    code = Value.cast(value)
    clipped = Mux(code > ONE, ONE, Mux(code < -ONE, -ONE, code))
    return FixedValue(COMPONENT, clipped[: COMPONENT.width].as_signed())
