"""Data-flow graphs, which describe a unit's words by functions and make the hardware of the words."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial, reduce
from operator import mul, or_
from typing import Any

from amaranth.hdl import Module, Mux, ShapeLike, Signal, Value, signed
from amaranth.lib.memory import Memory

from blysk.golden.number.fixed import Format
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.formula import SYMBOLS, formula_of
from blysk.hdl.core.memory import delayed, turn_of
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.schedule import Schedule, place
from blysk.hdl.core.word import Word, traced

__all__ = [
    "MULTIPLIER_BITS",
    "MULTIPLIER_LATENCY",
    "Dataflow",
    "FunctionalUnit",
    "checked_interval",
    "merged",
    "registered_product",
]

MULTIPLIER_BITS = 18
"""Bits of a multiplier's signed operands."""

MULTIPLIER_LATENCY = 2
"""Cycles of `registered_product`."""

_LONG, _WIDE = 4, 4
"""A word of at least `_WIDE` bits that waits for at least `_LONG` cycles waits in a memory."""


@dataclass(frozen=True, eq=False)
class FunctionalUnit:
    """Equal instances of hardware, which operations of a graph share.

    Parameters
    ----------
    graph : Dataflow
        Graph of the operations.
    name : str
        Prefix of its registers' names.
    shapes : sequence of ShapeLike
        Shapes of the operands; each instance has a register for every operand.
    latency : int
        Registers from the operand registers to the result.
    make : callable
        Function that makes an instance and returns its result. The first argument is a function that makes a
        register from a value and a name. The operands follow.
    """

    graph: "Dataflow"
    name: str
    shapes: Sequence[ShapeLike]
    latency: int
    make: Callable[..., Any]

    @property
    def count(self) -> int:
        """Number of instances."""
        return self.graph.schedule.counts.get(self, 0)

    def prefix(self, instance: int) -> str:
        """First characters of the names of an instance's registers."""
        return f"{self.name}_{instance}_"


class Dataflow:
    """Words of a `PipelinedUnit`, each a function of other words.

    Describe all words first, and each word after its operands. The first request for a word's stage, or for
    the number of instances, calls `place`. This puts the words on cycles, and on shared functional units such
    as multipliers. `build` makes the hardware. It copies a word that is read after its lifetime.

    Parameters
    ----------
    interval : int
        Initiation interval of the unit, at least 1.
    spaced : bool
        Whether beats may come at any distance of at least ``interval`` cycles. If not, the distance is a
        multiple of ``interval``. See `PipelinedUnit`.
    low_latency : bool
        Whether a product has one register behind its operand registers, and so takes two cycles in all.
    memories : bool
        Whether wide words with a long delay wait in memories of look-up tables. This needs an interval of 1.
    merges : bool
        Whether uses of a functional unit with the same operand share its gates.

    Raises
    ------
    ValueError
        If the interval is less than 1.

    Source: docs/theory/scheduling.md.
    """

    def __init__(
        self,
        interval: int,
        *,
        spaced: bool = False,
        low_latency: bool = False,
        memories: bool = False,
        merges: bool = False,
    ):
        if interval < 1:
            raise ValueError(f"interval must be at least 1, not {interval}")
        self.interval = interval
        self.spaced = spaced
        self.memories, self.merges = memories and interval == 1, merges
        self._words: list[Word] = []
        self._schedule: Schedule | None = None
        latency, product = MULTIPLIER_LATENCY, registered_product
        if low_latency:
            latency, product = 1, lambda register, a, b: register(a * b, "product")
        operand = signed(MULTIPLIER_BITS)
        self.multiplier = self.share("multiplier", (operand, operand), latency, product)

    @property
    def words(self) -> tuple[Word, ...]:
        """The words, each after its operands."""
        return tuple(self._words)

    @property
    def schedule(self) -> Schedule:
        """The words' cycles and instances. After the first read no word can be added."""
        if self._schedule is None:
            self._schedule = place(self._words, self.interval, self.spaced)
        return self._schedule

    def add(self, word: Word) -> Word:
        """Add a word that has been described elsewhere, behind its operands."""
        if self._schedule is not None:
            raise RuntimeError(f"{word.name} comes after the words were placed")
        word.graph = self
        self._words.append(word)
        return word

    def input(self, name: str, read: Callable[[Any], Any], formula: str | None = None) -> Word:
        """A word that is read from the beat: ``read(operands)``.

        Formulas show ``formula``. If it is ``None``, they show the symbol in `SYMBOLS`, or else the name.
        """
        first = 0 if self.interval == 1 else 1
        word = Word(name, (), 0, self.interval, since=first, text=formula or SYMBOLS.get(name, name))
        word.make = lambda build: read(build.operands)
        return self.add(word)

    def wire(self, name: str, function: Callable[[Any], Any], word: Word, formula: str | None = None) -> Word:
        """Wiring from a word's value. A copy for a later stage holds the wired value, not its source."""
        wire = Word(name, (word,), 0, word.lifetime, text=formula, trace=traced(function))
        wire.make = lambda build: function(build.at(word, wire.read))
        return self.add(wire)

    def register(
        self,
        name: str,
        function: Callable[..., Any],
        *words: Word,
        since: int | Word = 0,
        formula: str | None = None,
    ) -> Word:
        """A register that takes ``function`` of the words' values. It takes one cycle.

        Parameters
        ----------
        name : str
            Name of the word.
        function : callable
            Takes the values of ``words``, and returns the value of the register.
        *words : Word
            Operands of the register.
        since : int or Word
            Earliest stage of the word, or another word whose stage is the earliest. A word that is made late
            and read late needs no copies.
        formula : str or None
            Formula in drawings. ``None``: the formula read from ``function``.
        """
        register = Word(name, words, 1, self.interval, since=since, text=formula, trace=traced(function))

        def make(build):
            value = function(*(build.at(word, register.read) for word in words))
            return build.unit.register(build.m, value, name, when=build.when(register.read))

        register.make = make
        return self.add(register)

    def share(
        self, name: str, shapes: Sequence[ShapeLike], latency: int, make: Callable[..., Any]
    ) -> FunctionalUnit:
        """A functional unit; the parameters are those of `FunctionalUnit`."""
        return FunctionalUnit(self, name, shapes, latency, make)

    def use(
        self,
        functional_unit: FunctionalUnit,
        name: str,
        words: Sequence[Word],
        operands: Callable[..., Sequence[Any]],
        result: Callable[[Any], Any] = lambda value: value,
        latency: int | None = None,
        since: int | Word = 0,
        formula: str | None = None,
    ) -> Word:
        """Result of a functional unit. The result's lifetime is one cycle.

        Parameters
        ----------
        functional_unit : FunctionalUnit
            From `share`.
        name : str
            Name of the word.
        words : sequence of Word
            Words of the operands.
        operands : callable
            Wiring from the words' values to the operands.
        result : callable
            Wiring from the result of the functional unit to the value of the word.
        latency : int or None
            Registers from the operands to the value that ``result`` reads. ``None``: all registers of the
            functional unit.
        since : int or Word
            Earliest stage of the word, as for `register`.
        formula : str or None
            Formula in drawings. ``None``: the name of the word.
        """
        latency = functional_unit.latency if latency is None else latency
        use = Word(name, tuple(words), 1 + latency, 1, functional_unit, since, text=formula)
        use.trace = lambda *symbols: (None, formula_of(operands, symbols) or ())

        def make(build):
            given = operands(*(build.at(word, use.read) for word in words))
            return result(build.issue(functional_unit, use, given))

        use.make = make
        return self.add(use)

    def multiply(
        self,
        name: str,
        a: Word,
        b: Word,
        left: Callable[[Any], FixedValue] = lambda value: value,
        right: Callable[[Any], FixedValue] = lambda value: value,
        since: int | Word = 0,
        formula: str | None = None,
    ) -> Word:
        """Exact product of two words on a shared multiplier.

        It takes ``1 + MULTIPLIER_LATENCY`` cycles, or 2 cycles in a graph of low latency.

        Parameters
        ----------
        name : str
            Name of the word.
        a, b : Word
            Operands.
        left, right : callable
            Wiring from the value of a word to the operand, `MULTIPLIER_BITS` bits if signed, one bit less if
            unsigned.
        since : int
            As for `use`.
        formula : str or None
            Formula in drawings. ``None``: the product of its operands' formulas.

        Raises
        ------
        ValueError
            If an operand has too many bits.
        """
        format: list[Format] = []

        def operands(x, y):
            x, y = left(x), right(y)
            for value in (x, y):
                if value.format.width + (not value.format.signed) > MULTIPLIER_BITS:
                    raise ValueError(f"{value.format} is too wide for a multiplier")
            format.append(x.format * y.format)
            return x, y

        def product(code):
            return FixedValue(format[-1], code[: format[-1].width])

        word = self.use(self.multiplier, name, (a, b), operands, product, since=since, formula=formula)

        def trace(x, y):
            factors = [formula_of(side, (symbol,)) for side, symbol in ((left, x), (right, y))]
            if a is not b:
                # A factor that is some bits of a word has the word's symbol.
                factors = [own or symbol for own, symbol in zip(factors, (x, y), strict=True)]
            return formula_of(mul, factors), factors

        word.trace = trace
        return word

    def look_up(
        self,
        name: str,
        words: Sequence[int],
        width: int,
        address: Word,
        registered: bool = False,
        formula: str | None = None,
    ) -> Word:
        """Word of a table at an address. It takes one cycle, or two with the register of an FPGA's memory.

        Parameters
        ----------
        name : str
            Name of the table.
        words : sequence of int
            Words of the table. Their number is a power of two.
        width : int
            Bits of a word.
        address : Word
            Unsigned address, with as many bits as needed.
        registered : bool
            Whether there is a register behind the memory. Memory and register have the same enable.
        formula : str or None
            Formula of the word in drawings; ``None``: the name.
        """
        # The word that is read has the lifetime of the address.
        word = Word(name, (address,), 1 + registered, address.lifetime, text=formula)

        def make(build):
            memory = Memory(shape=width, depth=len(words), init=words)
            build.m.submodules[name] = memory
            port = memory.read_port()
            build.m.d.comb += port.addr.eq(build.at(address, word.read))
            return build.unit.register(build.m, port.data, f"{name}_word") if registered else port.data

        word.make = make
        return self.add(word)

    def build(self, m: Module, unit: PipelinedUnit, operands: Any) -> Callable[..., Any]:
        """Make the hardware. Return the function `_Build.at`, which gives a word's value at a stage.

        Parameters
        ----------
        m : Module
            Module that gets the registers.
        unit : PipelinedUnit
            Unit of the beats, with the initiation interval of the graph.
        operands
            Operands of `PipelinedUnit.datapath` of the unit.
        """
        build = _Build(self, m, unit, operands)
        for word in self._words:
            build.values[word] = {word.stage: word.make(build)}
        build.connect()
        return build.at


def registered_product(register: Callable[[Any, str], Any], a: Any, b: Any) -> Any:
    """Exact product, `MULTIPLIER_LATENCY` cycles: a register for each operand, and one for the product.

    An FPGA's multipliers lie in few places, far from the multiplexers of operands and the adders of products.
    These registers can go into the multiplier block. So the wires to the block have a whole cycle, and so
    have the wires from it.

    Parameters
    ----------
    register : callable
        Makes a register from a value and a name.
    a, b
        Operands.
    """
    a, b = register(a, "a"), register(b, "b")
    return register(a * b, "product")


def checked_interval(interval: int | None, longest: int, default: int | None = None) -> int:
    """Check an initiation interval: 1 to ``longest``. With ``longest`` one multiplier makes all products.

    ``None`` means ``default``, or ``longest`` without a default.

    Raises
    ------
    ValueError
        If the interval is out of range.
    """
    if interval is None:
        return default or longest
    if interval not in range(1, longest + 1):
        raise ValueError(f"initiation_interval must be 1 to {longest}, not {interval!r}")
    return interval


class _Build:
    """Hardware of a graph while it is being made."""

    def __init__(self, graph: Dataflow, m: Module, unit: PipelinedUnit, operands: Any):
        self.graph, self.m, self.unit, self.operands = graph, m, unit, operands
        self.values: dict[Word, dict[int, Any]] = {}
        # Further hardware of several words, by the resource of the words.
        self.shared: dict[Any, Any] = {}
        self._instances: dict[tuple[FunctionalUnit, int], tuple[list[Signal], Any]] = {}
        self._turn_of = cache(partial(turn_of, m))
        self._issued: dict[tuple[FunctionalUnit, int], list[tuple[Value | None, Sequence[Any]]]] = {}

    def when(self, stage: int) -> Value | None:
        """Condition to write a register of a stage. ``None``: on every cycle, because a beat may come."""
        return self.unit.at(stage) if self.unit.initiation_interval > 1 else None

    def at(self, word: Word, stage: int, cycles: int = 1) -> Any:
        """Value of a word for ``cycles`` cycles from a stage on. After its lifetime the word is copied."""
        copies = self.values[word]
        first = max(start for start in copies if start <= stage)
        if self.graph.memories and stage - first >= _LONG and len(Value.cast(copies[first])) >= _WIDE:
            name, cycles = f"{word.name}_{stage}", stage - first
            copies[stage] = delayed(self.m, name, copies[first], cycles, self._turn_of(cycles))
            return copies[stage]
        lifetime = word.lifetime if first == word.stage else self.unit.initiation_interval
        while stage + cycles > first + lifetime:
            if first == stage:
                raise ValueError(f"{word.name} does not stay for {cycles} cycles from stage {stage} on")
            value = copies[first]
            first = min(first + lifetime, stage)
            copies[first] = self.unit.register(
                self.m, value, f"{word.name}_{first}", when=self.when(first - 1)
            )
            lifetime = self.unit.initiation_interval
        return copies[first]

    def issue(self, functional_unit: FunctionalUnit, use: Word, operands: Sequence[Any]) -> Any:
        """Issue operands to an instance of a functional unit. Returns the result that all its uses read."""
        placement = self.graph.schedule.placements[use]
        instance, when = placement.instance, self.when(placement.read)
        key = functional_unit, instance
        if key not in self._instances:
            given = [
                Signal(shape, name=f"{functional_unit.prefix(instance)}{k}", reset_less=True)
                for k, shape in enumerate(functional_unit.shapes)
            ]

            def register(value, name):
                return self.unit.register(self.m, value, f"{functional_unit.prefix(instance)}{name}")

            self._instances[key] = given, functional_unit.make(register, *given)
        self._issued.setdefault(key, []).append((when, operands))
        return self._instances[key][1]

    def result(self, functional_unit: FunctionalUnit, instance: int) -> Any:
        """Result of an instance of a functional unit, on every cycle."""
        return self._instances[functional_unit, instance][1]

    def connect(self) -> None:
        """Connect shared hardware, and each instance's operand registers, which have no enable.

        No two uses fall on the same cycle, so their operands are gated and merged by OR. A chain with a
        multiplexer for each use would be larger.
        """
        for hardware in self.shared.values():
            hardware.connect()
        for key, uses in self._issued.items():
            for k, to in enumerate(self._instances[key][0]):
                values = [(when, Value.cast(operands[k])) for when, operands in uses]
                value = merged(values, self.graph.merges)
                self.m.d.sync += Value.cast(to).eq(value)


def merged(uses: Sequence[tuple[Value | None, Value]], merges: bool = True) -> Value:
    """The value whose condition is high. Values are gated, and merged by OR. A single value is not gated.

    With ``merges`` the conditions of a value, the same object of Python, are merged first.
    """
    sources: dict[int, tuple[Value, list[Value | None]]] = {}
    for number, (when, value) in enumerate(uses):
        sources.setdefault(id(value) if merges else number, (value, []))[1].append(when)
    if len(sources) == 1:
        return next(iter(sources.values()))[0]
    return reduce(or_, (Mux(reduce(or_, whens), value, 0) for value, whens in sources.values()))
