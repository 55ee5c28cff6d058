# amaranth: UnusedElaboratable=no
"""Structures: read right from a component made for this test, and complete for the units."""

from functools import cache
from itertools import pairwise

import pytest
from amaranth.hdl import Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, memory, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.bench.tools.drawing import _WIDEST, _bands, _Layout, draw_structure
from blysk.bench.tools.graph import Graph, Node, layers
from blysk.bench.tools.netlist import Netlist, describe_shape
from blysk.bench.tools.structure import graph_of
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.hdl.core.fixed import SQ
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.geometry.edge_setup import EdgeSetupUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.video.vertex_unit import VertexUnit


@cache
def structure_of(unit):
    """A unit's structure, which is only read."""
    return graph_of(unit())


VECTOR = data.ArrayLayout(signed(8), 3)


class Sample(Component):
    """Three products of one shape, a ROM, an accumulator, a choice, a delay, and control."""

    i: In(stream.Signature(data.StructLayout({"a": VECTOR, "b": VECTOR, "which": 1})))
    o: Out(stream.Signature(data.StructLayout({"products": data.ArrayLayout(16, 3), "total": 16, "late": 8})))

    def elaborate(self, platform):
        m = Module()
        m.submodules.table = table = memory.Memory(shape=unsigned(16), depth=8, init=range(8))
        port = table.read_port()
        busy = Signal(4)
        m.d.sync += busy.eq(busy + 1)
        enable = busy == 0
        operands = self.i.payload
        for k in range(3):
            product = Signal(16, name=f"product_{k}")
            with m.If(enable):
                m.d.sync += product.eq(operands.a[k] * operands.b[k])
            m.d.comb += self.o.payload.products[k].eq(product)
        total, chosen = Signal(16, name="total"), Signal(8, name="chosen")
        early, late = Signal(8, name="early"), Signal(8, name="late")
        m.d.sync += [
            chosen.eq(Mux(operands.which, operands.a[0], operands.b[0])),
            early.eq(chosen),
            late.eq(early),
            total.eq(total + port.data),
        ]
        m.d.comb += [
            port.addr.eq(chosen),
            self.o.payload.total.eq(total),
            self.o.payload.late.eq(late),
            self.o.valid.eq(enable),
            self.i.ready.eq(enable),
        ]
        return m


def by_name(graph):
    return {node.name: (number, node) for number, node in graph.nodes.items()}


def test_sample():
    graph = graph_of(Sample())
    nodes = by_name(graph)
    # No part of the control is drawn, and no box twice.
    assert set(nodes) == {"a", "b", "which", "product", "chosen", "total", "late", "products", "table"}
    kinds = {name: node.kind for name, (_, node) in nodes.items()}
    assert kinds["a"] == kinds["b"] == kinds["which"] == "input"
    assert kinds["products"] == kinds["late"] == "output"
    assert kinds["table"] == "memory"
    assert nodes["table"][1].detail == "ROM 8 × 16"
    assert nodes["a"][1].detail == "3 × 8 bits, signed"
    product = nodes["product"][1]
    assert (product.copies, product.operations["×"], product.detail) == (3, 1, "16")
    assert nodes["chosen"][1].operations["mux"] == 1
    registers = [node for node in graph.nodes.values() if node.kind == "register"]
    # The two registers after `chosen` only hold its word.
    assert sorted((node.name, node.stages) for node in registers) == [
        ("chosen", 3),
        ("product", 1),
        ("total", 1),
    ]
    total = next(n for n, node in graph.nodes.items() if node.kind == "register" and node.name == "total")
    assert graph.nodes[total].operations["+"] == 1
    edges = graph.edges
    number = {name: n for name, (n, node) in nodes.items() if node.kind != "output"} | {"total": total}
    assert edges[number["a"], number["product"]]
    assert edges[number["table"], total]
    assert edges[total, total]
    # A signal that only chooses is distinguished from the chosen data.
    assert edges[number["which"], number["chosen"]] is False
    assert edges[number["a"], number["chosen"]]
    assert (number["product"], number["product"]) not in edges


FLAT = [DotProductUnit, GPQUnit, DifferenceSetupUnit, DifferenceAccumulatorUnit, SpecularUnit]


@pytest.mark.parametrize(
    "unit", [GPQUnit, *(pytest.param(unit, marks=pytest.mark.long) for unit in FLAT if unit is not GPQUnit)]
)
def test_parts_are_those_of_the_netlist(unit):
    graph, cost = structure_of(unit), cost_of(unit())
    for symbol, count in (("×", cost.multiplier_count), ("×c", cost.constant_multipliers)):
        assert sum(node.copies * node.operations[symbol] for node in graph.nodes.values()) == count
    bits = 0
    for node in graph.nodes.values():
        if node.kind == "memory":
            kind, depth, _, width = node.detail.split()
            assert kind == "ROM"
            bits += int(depth) * int(width)
    assert bits == cost.rom_bits
    # No register is invented. Registers of the control are left out.
    shown = sum(int(n.detail) * n.copies * n.stages for n in graph.nodes.values() if n.kind == "register")
    assert 0.5 * cost.register_bits < shown <= cost.register_bits


UNITS = [*FLAT, BisectionUnit, LightUnit, lambda: QuadraticEvaluatorUnit(QuadraticEvaluator("horner"))]


@pytest.mark.long
@pytest.mark.parametrize("unit", UNITS)
def test_every_port_takes_part(unit):
    graph = structure_of(unit)
    sources, targets = graph.neighbours()
    for number, node in graph.nodes.items():
        if node.kind == "input":
            assert targets[number], node.name
        else:
            assert sources[number], node.name


@pytest.mark.parametrize(
    "unit", [GPQUnit, *(pytest.param(unit, marks=pytest.mark.long) for unit in UNITS if unit is not GPQUnit)]
)
def test_columns_and_boxes(unit):
    graph = structure_of(unit)
    columns, back = layers(graph)
    for edge in graph.edges:
        assert (columns[edge[0]] < columns[edge[1]]) == (edge not in back)
    shown = 0
    for band in _bands(graph):
        boxes = [place for place in _Layout(band).places if place.node]
        assert len(boxes) == len(band.graph.nodes)
        shown += sum(place.node.kind != "tag" for place in boxes)
        for k, a in enumerate(boxes):
            for b in boxes[:k]:
                apart_x = abs(a.x - b.x) >= (a.width + b.width) / 2
                apart_y = abs(a.y - b.y) >= (a.height + b.height) / 2 - 1e-6
                assert apart_x or apart_y
    assert shown == len(graph.nodes)


class Chain(Component):
    """A dot product behind another."""

    i: In(stream.Signature(DotProductUnit().i.payload.shape()))
    o: Out(stream.Signature(DotProductUnit().o.payload.shape()))

    def elaborate(self, platform):
        m = Module()
        m.submodules.first = first = DotProductUnit()
        m.submodules.second = second = DotProductUnit()
        m.d.comb += [
            first.i.payload.eq(self.i.payload),
            second.i.payload.a.eq(self.i.payload.b),
            second.i.payload.b[0].as_value().eq(first.o.payload.as_value()[-18:]),
            self.o.payload.eq(second.o.payload),
            first.i.valid.eq(self.i.valid),
            second.i.valid.eq(first.o.valid),
            self.o.valid.eq(second.o.valid),
            self.i.ready.eq(first.i.ready),
            first.o.ready.eq(second.i.ready),
            second.o.ready.eq(self.o.ready),
        ]
        return m


def test_submodules_are_boxes():
    graph = graph_of(Chain())
    nodes = by_name(graph)
    assert [(node.name, node.detail) for node in graph.nodes.values() if node.kind == "unit"] == [
        ("first", "dot product"),
        ("second", "dot product"),
    ]
    a, b, first, second, o = (nodes[name][0] for name in ("a", "b", "first", "second", "o"))
    arrows = {(a, first), (b, first), (b, second), (first, second), (second, o)}
    assert graph.edges == dict.fromkeys(arrows, True)


@pytest.mark.long
def test_large_structures_are_cut_down():
    few = graph_of(BisectionUnit(), most=1)
    assert len(few.nodes) < len(structure_of(BisectionUnit).nodes)
    assert {node.name for node in few.nodes.values()} >= {"normal_a", "normal_b", "out_of_range"}
    assert all(node.kind != "register" or +node.operations for node in few.nodes.values())


@pytest.mark.parametrize(
    "unit",
    [
        GPQUnit,
        *(
            pytest.param(unit, marks=pytest.mark.long)
            for unit in (PowerUnit, AngularSetupUnit, EdgeSetupUnit)
        ),
    ],
)
def test_every_adder_is_drawn(unit):
    """Adders that count the cycles of a unit are control."""

    def adders(graph):
        return sum(node.copies * node.operations[s] for node in graph.nodes.values() for s in ("+", "−"))

    assert adders(structure_of(unit)) >= 0.9 * adders(Netlist(unit()).graph)


def test_boxes_have_formulas():
    nodes = structure_of(BisectionUnit).nodes.values()
    shown = {node.name: node.formulas for node in nodes if node.formulas}
    assert shown["dot_total"] == ("N_a·N_b",)
    assert {"N_a,x·N_b,x", "N_a,z·N_b,z"} <= set(shown["multiplier_0_product"])
    assert shown["half_sum_0"] == ("(N_a,x + N_b,x)/2",)
    assert shown["u"] == ("u = 1 − N_a·N_b",)
    # A shared multiplier shows all its uses. None has only the name of its instance.
    assert all(node.formulas for node in nodes if node.operations["×"])
    assert [node.formulas for node in structure_of(DotProductUnit).nodes.values() if node.name == "sum"] == [
        ("a·b",)
    ]


def test_an_accumulator_has_the_formulas_of_its_sums():
    """One register has all sums of products of the vertex unit."""
    (formulas,) = [n.formulas for n in structure_of(VertexUnit).nodes.values() if n.name == "sum"]
    assert "w_offset + P_x·w_entry_0" in formulas
    assert "y_sum_1 + P_z·y_entry_2" in formulas


def test_loop_leads_back():
    graph = Graph()
    a, b, c = (graph.add(Node("register", name)) for name in "abc")
    for source, target in ((a, b), (b, c), (c, b)):
        graph.connect(source, target, True)
    columns, back = layers(graph)
    assert columns == {a: 0, b: 1, c: 2}
    assert back == {(c, b)}
    figure = draw_structure(graph)
    assert figure.get_size_inches()[0] > 0


def row_of_boxes(count):
    """A chain of boxes, with arrows from the first to the last and back from the last to the second."""
    graph = Graph()
    numbers = [graph.add(Node("register", f"register_{k}", "18")) for k in range(count)]
    for a, b in pairwise(numbers):
        graph.connect(a, b, True)
    graph.connect(numbers[0], numbers[-1], False)
    graph.connect(numbers[-1], numbers[1], True)
    return graph


@pytest.mark.long
def test_a_wide_drawing_is_folded():
    graph = row_of_boxes(40)
    bands = _bands(graph)
    assert len(bands) > 3
    assert sorted(number for band in bands for number in band.graph.nodes if number in graph.nodes) == list(
        range(40)
    )
    # An arrow stays in a band, or ends at a tag and starts at a tag of the same text.
    ways = {}
    leaves, arrives = {}, []
    for band in bands:
        for (a, b), is_data in band.graph.edges.items():
            if a in graph.nodes and b in graph.nodes:
                ways[a, b] = is_data
            elif a in graph.nodes:
                leaves[band.graph.nodes[b].name] = a
            else:
                arrives.append((band.graph.nodes[a].name, b, is_data))
    ways |= {(leaves[text], b): is_data for text, b, is_data in arrives}
    assert ways == graph.edges
    # No two tags have the same number.
    assert len({text.split()[0] for text in leaves}) == len(leaves) == len(bands) + 1
    assert draw_structure(graph).get_size_inches()[0] * 72 < 1.15 * _WIDEST


def test_a_narrow_drawing_is_not_folded():
    graph = row_of_boxes(4)
    (band,) = _bands(graph)
    assert band.graph is graph
    assert (3, 1) in band.back


@pytest.mark.long
def test_drawings_have_the_width_of_a_page():
    for unit in (BisectionUnit, DifferenceSetupUnit):
        graph = structure_of(unit)
        assert len(_bands(graph)) > 1
        assert draw_structure(graph).get_size_inches()[0] * 72 < 1.15 * _WIDEST


def test_shapes():
    assert describe_shape(SQ(1, 17)) == "SQ(1, 17)"
    assert describe_shape(data.ArrayLayout(SQ(1, 17), 3)) == "3 × SQ(1, 17)"
    assert describe_shape(unsigned(1)) == "1 bit"
    assert describe_shape(signed(4)) == "4 bits, signed"
