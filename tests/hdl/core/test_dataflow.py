# amaranth: UnusedElaboratable=no
"""Data-flow graphs: small units against NumPy, cycle by cycle."""

import re

import numpy as np
import pytest
from amaranth.hdl import Cat, Const, Module, Mux, Value, signed, unsigned
from amaranth.lib import data

from blysk.bench.units.record import STALLS, Case, UnitRun
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.hdl.core.dataflow import MULTIPLIER_BITS, Dataflow, checked_interval
from blysk.hdl.core.dot import dot, shared_sums
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate

from ...checks import assert_equals_model

OPERAND = SQ(1, 17)
INPUTS = data.StructLayout({"a": FixedShape(OPERAND), "b": FixedShape(OPERAND), "n": unsigned(5)})
SQUARES = [k * k for k in range(32)]
INTERVALS = [3, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2, 4, 5, 6))]


class GraphUnit(PipelinedUnit):
    """A unit made from a graph. ``describe`` gives its results by name, each with its shape."""

    def __init__(self, interval, describe, spaced=False, memories=False, stands=False):
        self.graph = Dataflow(interval, spaced=spaced, memories=memories)
        inputs = {
            name: self.graph.input(name, lambda operands, name=name: operands[name])
            for name in INPUTS.members
        }
        self.results, shapes = describe(self.graph, **inputs)
        latency = max(1, *(word.stage for word in self.results.values()))
        super().__init__(
            INPUTS,
            data.StructLayout(shapes),
            latency=latency,
            initiation_interval=interval,
            spaced=spaced,
            stands=stands,
        )

    def datapath(self, m, operands):
        value = self.graph.build(m, self, operands)
        names = self.o.payload.shape().members
        cycles = 1 + self.stands
        words = (Value.cast(value(self.results[name], self.latency, cycles)) for name in names)
        return self.o.payload.shape()(Cat(words))


def verify(unit, beats, expected):
    """Compare under every pattern of stalls."""
    rng = np.random.default_rng(2026)
    for shares in STALLS:
        names, periods = ("input_stalls", "output_stalls"), (997, 1009)
        stalls = {name: rng.random(n) < s for name, n, s in zip(names, periods, shares, strict=True) if s}
        assert_equals_model(unit, UnitRun(Case(beats), expected, None, stalls), "pysim")


def beats_of(rng, count=100):
    a, b = rng.integers(-(2**17), 2**17, (2, count))
    ends = [-(2**17), 2**17 - 1]
    a[:4], b[:4] = np.repeat(ends, 2), np.tile(ends, 2)
    return {"a": a, "b": b, "n": rng.integers(0, 32, count)}


# Graphs for hardware.


def copies(g, a, b, n):
    """The inputs again, long after the beat has moved on, beside chains of registers."""
    late = b
    for k in range(13):
        late = g.register(f"late_{k}", lambda x: x, late)
    total = g.register("total", lambda a, late: a + late, a, late)
    return {"a": a, "n": n, "total": total}, {
        "a": FixedShape(OPERAND),
        "n": unsigned(5),
        "total": FixedShape(SQ(2, 17)),
    }


def products(g, a, b, n):
    """``a b``, ``b^2``, their product cut to operands, and ``a b`` again after all of these."""
    ab, bb = g.multiply("ab", a, b), g.multiply("bb", b, b)
    fourth = g.multiply("fourth", ab, bb, *([lambda x: x.truncate(15).saturate(SQ(1, 15))] * 2))
    mixed = g.multiply("mixed", fourth, a, lambda x: x.truncate(10).saturate(SQ(1, 10)))
    return {"ab": ab, "fourth": fourth, "mixed": mixed}, {
        "ab": FixedShape(SQ(2, 34)),
        "fourth": FixedShape(SQ(2, 30)),
        "mixed": FixedShape(SQ(2, 27)),
    }


def table(g, a, b, n):
    """``n^2`` from a table, in a sum and alone, long after the input."""
    square = g.look_up("squares", SQUARES, 10, n)
    total = g.register("total", lambda square, n: (square + n)[:11], square, n)
    late = total
    for k in range(9):
        late = g.register(f"late_{k}", lambda x: x, late)
    return {"square": square, "total": total, "late": late}, {
        "square": unsigned(10),
        "total": unsigned(11),
        "late": unsigned(11),
    }


def shifts(g, a, b, n):
    """One operator shifts three registers to the right, and its results are its operands again."""

    def make(register, value, amount):
        coarse = register(value >> Cat(Const(0, 2), amount[2:]), "coarse")
        fine = register(amount[:2], "fine")
        shifted = register(coarse >> fine, "shifted")
        return register(Mux(shifted[-1], -1, shifted)[:18].as_signed(), "result")

    functional_unit = g.share("shifter", (signed(18), unsigned(4)), 3, make)

    def use(name, value):
        return g.use(functional_unit, name, (value, n), lambda value, n: (Value.cast(value), n[:4]))

    first, second = use("first", a), use("second", b)
    return {"twice": use("twice", first), "again": use("again", second)}, {
        "twice": signed(18),
        "again": signed(18),
    }


def late_and_early(g, a, b, n):
    """A piece of a word that is read after one register and after both, and a wire that is copied in place of
    its word."""

    def make(register, x, y):
        first = register(x + y, "first")
        return first, register((first + x).wrap(SQ(3, 17)), "second")

    functional_unit = g.share("adder", (FixedShape(OPERAND), FixedShape(OPERAND)), 2, make)
    early = g.use(functional_unit, "early", (a, b), lambda *ab: ab, lambda results: results[0], latency=1)
    low = g.wire("low", lambda a: Value.cast(a)[:5], a)
    late = g.register("late", lambda low, n: low ^ n, low, n, since=12)
    again = g.use(
        functional_unit, "again", (a, b), lambda *ab: ab, lambda results: results[0], latency=1, since=11
    )
    return {"early": early, "late": late, "again": again}, {
        "early": FixedShape(SQ(2, 17)),
        "late": unsigned(5),
        "again": FixedShape(SQ(2, 17)),
    }


def functions_of(a, b, n):
    """The right results of each graph, from the inputs."""
    x, y = Fixed(OPERAND, a), Fixed(OPERAND, b)
    fourth = (x * y).truncate(15).saturate(SQ(1, 15)) * (y * y).truncate(15).saturate(SQ(1, 15))
    mixed = fourth.truncate(10).saturate(SQ(1, 10)) * x

    def shifted(value):
        value = value >> (n & 15)
        return np.where(value < 0, -1, value)

    return {
        copies: {"a": a, "n": n, "total": a + b},
        products: {"ab": (x * y).codes, "fourth": fourth.codes, "mixed": mixed.codes},
        table: {"square": n**2, "total": n**2 + n, "late": n**2 + n},
        shifts: {"twice": shifted(shifted(a)), "again": shifted(shifted(b))},
        late_and_early: {"early": a + b, "late": a & 31 ^ n, "again": a + b},
    }


@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("graph", [copies, products, table, shifts, late_and_early])
def test_graphs_equal_their_functions(graph, interval):
    beats = beats_of(np.random.default_rng(interval))
    unit = GraphUnit(interval, graph)
    verify(unit, beats, functions_of(**beats)[graph])
    if graph is copies:
        assert unit.latency == 14 + (interval > 1)
    if graph is products:
        assert cost_of(GraphUnit(interval, products)).multiplier_count == -(-4 // interval)


@pytest.mark.parametrize("graph", [copies, table, late_and_early])
def test_words_that_wait_in_memories(graph):
    """Words that wait in memories give the same results in the same cycles, with fewer registers."""
    beats = beats_of(np.random.default_rng(1))
    verify(GraphUnit(1, graph, memories=True), beats, functions_of(**beats)[graph])
    registers, memories = (cost_of(GraphUnit(1, graph, memories=m)) for m in (False, True))
    assert memories.register_bits < registers.register_bits
    assert memories.ram_bits > registers.ram_bits == 0


@pytest.mark.parametrize("interval", [2, 3])
def test_results_that_stand_need_no_spare_register(interval):
    """Results that stand come in the same cycles under stalls, with fewer registers."""
    beats = beats_of(np.random.default_rng(interval))
    verify(GraphUnit(interval, copies, stands=True), beats, functions_of(**beats)[copies])
    bits = [cost_of(GraphUnit(interval, copies, stands=stands)).register_bits for stands in (False, True)]
    assert bits[1] < bits[0]


def test_refuses_a_result_that_does_not_stand():
    """The result of a shared unit is there for one cycle only."""
    unit = GraphUnit(3, shifts, stands=True)
    with pytest.raises(ValueError, match=r"^\w+ does not stay for 2 cycles from stage \d+ on$"):
        cost_of(unit)


WORD = 18


def wrapped(code):
    """The code in 18 bits, signed."""
    return (code + (1 << WORD - 1)) % (1 << WORD) - (1 << WORD - 1)


class RandomGraph:
    """Shared sums and products of random words, registers and copies, in hardware and in NumPy."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.steps = [
            (str(rng.choice(["sum", "product", "register"])), *rng.integers(0, 3 + k, 2).tolist())
            for k in range(int(rng.integers(8, 16)))
        ]

    def describe(self, g, a, b, n):
        """Words of the graph. The last five words are results."""

        def add(register, x, y):
            return register((register(x, "x") + register(y, "y"))[:WORD].as_signed(), "total")

        adders = g.share("adder", (signed(WORD), signed(WORD)), 2, add)
        words = [g.wire(name, lambda v: Value.cast(v).as_signed(), w) for name, w in (("a", a), ("b", b))]
        words.append(g.register("n", lambda n: Cat(n, Const(0, WORD - 5)).as_signed(), n))
        for k, (kind, first, second) in enumerate(self.steps):
            x, y = words[first], words[second]
            name = f"{kind}_{k}"
            if kind == "sum":
                word = g.use(adders, name, (x, y), lambda x, y: (x, y))
            elif kind == "product":
                number = lambda v: FixedValue(OPERAND, v)  # noqa: E731
                product = g.multiply(name, x, y, number, number)
                word = g.wire(f"{name}_low", lambda v: Value.cast(v)[9 : 9 + WORD].as_signed(), product)
            else:
                word = g.register(name, lambda x, y: x ^ y, x, y)
            words.append(word)
        results = {f"result_{k}": word for k, word in enumerate(words[-5:])}
        return results, dict.fromkeys(results, signed(WORD))

    def compute(self, beats):
        """The right results."""
        words = [beats["a"], beats["b"], beats["n"]]
        for kind, first, second in self.steps:
            x, y = words[first], words[second]
            words.append({"sum": wrapped(x + y), "product": wrapped(x * y >> 9), "register": x ^ y}[kind])
        return {f"result_{k}": word for k, word in enumerate(words[-5:])}


@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.long) for k in range(2, 7))])
def test_spaced_graphs_at_any_distance(interval, seed):
    """A random graph equals its function if beats come at the interval, and at every longer distance."""
    graph, rng = RandomGraph([interval, seed]), np.random.default_rng(seed)
    unit = GraphUnit(interval, graph.describe, spaced=True)
    beats = beats_of(rng)
    expected = graph.compute(beats)
    verify(unit, beats, expected)
    distances = rng.integers(interval, 3 * interval + 1, 99)
    stalls = np.ones(int(distances.sum()) + 2, dtype=bool)
    stalls[np.r_[0, np.cumsum(distances)]] = False
    run = simulate(unit, beats, count=100, engine="pysim", input_stalls=stalls)
    for name, words in expected.items():
        np.testing.assert_array_equal(run.beats[name], words)
    # No beat has to wait longer than the interval.
    np.testing.assert_array_equal(np.diff(run.input_cycles), distances)
    np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)


# Refusals.


@pytest.mark.parametrize("interval", [0, -3])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        Dataflow(interval)


def test_refuses_words_after_they_were_placed():
    g = Dataflow(3)
    a = g.input("a", lambda operands: operands)
    assert g.register("once", lambda a: a, a).stage == 2
    with pytest.raises(RuntimeError, match=r"^late comes after the words were placed$"):
        g.register("late", lambda a: a, a)


@pytest.mark.parametrize(
    ("format", "accepted"), [(SQ(1, 17), True), (SQ(2, 17), False), (UQ(0, 17), True), (UQ(1, 17), False)]
)
def test_refuses_an_operand_that_is_too_wide(format, accepted):
    def describe(g, a, b, n):
        operand = g.register(
            "operand", lambda a: FixedValue(format, Cat(Value.cast(a), Value.cast(a))[: format.width]), a
        )
        word = g.multiply("product", b, operand)
        return {"product": word}, {"product": FixedShape(OPERAND * format)}

    unit = GraphUnit(1, describe)
    if accepted:
        unit.datapath(Module(), unit.i.payload)
        return
    with pytest.raises(ValueError, match=rf"^{re.escape(str(format))} is too wide for a multiplier$"):
        unit.datapath(Module(), unit.i.payload)


def test_multiplier_bits():
    assert MULTIPLIER_BITS == 18


# Dot products.


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("interval", [3, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2, 5, 9))])
def test_dot_products(interval, shared):
    """Dot products of two words, of a word with itself, and of a word with a function of this word."""

    def describe(g, a, b, n):
        half = FixedValue.constant(OPERAND, 0.5)

        def vector_of(*words):
            return data.ArrayLayout(FixedShape(OPERAND), 3)(Cat(Value.cast(word) for word in words))

        vector = g.wire("vector", lambda a: vector_of(a, half, a), a)
        other = g.register("other", lambda b: vector_of(b, b, half), b)
        sums = shared_sums(g, OPERAND * OPERAND) if shared else None
        words = {
            "two": dot(g, "two", vector, other, sums),
            "own": dot(g, "own", vector, vector, sums),
            "made": dot(g, "made", vector, lambda v: [v[1], v[2], v[1]], sums),
        }
        return words, dict.fromkeys(
            words, FixedShape(OPERAND * OPERAND + OPERAND * OPERAND + OPERAND * OPERAND)
        )

    beats = beats_of(np.random.default_rng(interval))
    a, b, half = beats["a"], beats["b"], 1 << 16
    unit = GraphUnit(interval, describe)
    assert cost_of(unit).multiplier_count == -(-9 // interval)
    verify(unit, beats, {"two": a * b + half * (b + a), "own": 2 * a * a + half * half, "made": 3 * half * a})


def test_checked_interval():
    assert [checked_interval(interval, 4) for interval in (1, 4, None)] == [1, 4, 4]
    assert checked_interval(None, 4, 2) == 2
    for interval in (0, 5, -1, 1.5):
        with pytest.raises(ValueError, match=rf"^initiation_interval must be 1 to 4, not {interval}$"):
            checked_interval(interval, 4)
