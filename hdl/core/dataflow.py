"""Data-flow graphs: words of a unit, placed in time and on shared operators, then built as registers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from amaranth.hdl import Module, ShapeLike, Signal, Value, signed
from amaranth.lib.memory import Memory

from blysk.golden.number.fixed import Format
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.stream import PipelinedUnit

__all__ = [
    "MULTIPLIER_BITS",
    "MULTIPLIER_LATENCY",
    "Dataflow",
    "FunctionalUnit",
    "Word",
    "checked_interval",
    "dot",
    "registered_product",
    "shared_sums",
]

MULTIPLIER_BITS = 18
"""Bits of a multiplier's signed operands."""

MULTIPLIER_LATENCY = 4
"""Cycles of `registered_product`."""


@dataclass(frozen=True, eq=False)
class Word:
    """A word of a data flow.

    Parameters
    ----------
    name : str
        Of its register.
    stage : int
        Enabled cycles from the input of a beat to the first on which the word can be read.
    lifetime : int
        Cycles on which it can be read, before the next beat's word replaces it.
    """

    name: str
    stage: int
    lifetime: int


@dataclass(frozen=True, eq=False)
class FunctionalUnit:
    """Equal instances of hardware, shared by the uses of a graph.

    Parameters
    ----------
    name : str
        Of its operand registers.
    shapes : sequence of ShapeLike
        Operands; each instance has a register for every one.
    latency : int
        Registers from those of the operands to the result.
    make : callable
        Makes an instance: from a function that makes a register (value, name) and the operands, the result.
    left : list of int
        Uses that may still come.
    taken : list of set of int
        For each instance the stages at which it has a use.
    """

    name: str
    shapes: Sequence[ShapeLike]
    latency: int
    make: Callable[..., Any]
    left: list[int]
    taken: list[set[int]] = field(default_factory=list)

    @property
    def count(self) -> int:
        """How many instances there are."""
        return len(self.taken)


class Dataflow:
    """The words of a `PipelinedUnit` and how each is computed from others, before there is any hardware.

    Every word gets the earliest stage at which its operands can be read. A shared functional unit, such as a
    multiplier, is issued when a slot of it is free: beats come a whole multiple of the initiation interval
    apart, so an instance has as many slots as the interval has cycles, and ``ceil(uses / interval)``
    instances serve all. In a *spaced* graph beats come at any distance from the interval on: then the uses of
    an instance lie within as many stages as the interval has cycles, and there are as many more instances as
    that takes. Uses get slots in the order in which they are added. A word that is read after its lifetime is
    copied by `build`.

    Parameters
    ----------
    interval : int
        Initiation interval of the unit, at least 1.
    multiplications : int
        How many there will be.
    spaced : bool
        Whether beats come at any distance from the interval on; see `PipelinedUnit`.
    low_latency : bool
        Whether a product takes a single register, two cycles in all.

    Raises
    ------
    ValueError
        If the interval is less than 1.
    """

    def __init__(
        self, interval: int, multiplications: int = 0, *, spaced: bool = False, low_latency: bool = False
    ):
        if interval < 1:
            raise ValueError(f"interval must be at least 1, not {interval}")
        self.interval = interval
        self.spaced = spaced
        self._makers: list[tuple[Word, Callable[[_Build], Any]]] = []
        latency, product = MULTIPLIER_LATENCY, registered_product
        if low_latency:
            latency, product = 1, lambda register, a, b: register(a * b, "product")
        operand = signed(MULTIPLIER_BITS)
        self.multiplier = self.share("multiplier", multiplications, (operand, operand), latency, product)

    def _add(self, name: str, stage: int, lifetime: int, make: Callable[["_Build"], Any]) -> Word:
        word = Word(name, stage, lifetime)
        self._makers.append((word, make))
        return word

    def input(self, name: str, read: Callable[[Any], Any]) -> Word:
        """A word of the beat: ``read(operands)``."""
        first = 0 if self.interval == 1 else 1
        return self._add(name, first, self.interval, lambda build: read(build.operands))

    def wire(self, name: str, function: Callable[[Any], Any], word: Word) -> Word:
        """Wiring from a word's value; read after the word's lifetime, the wire is copied, not the word."""
        return self._add(name, word.stage, word.lifetime, lambda build: function(build.at(word, word.stage)))

    def register(self, name: str, function: Callable[..., Any], *words: Word, since: int = 0) -> Word:
        """A register of ``function`` of the words' values: one cycle.

        Parameters
        ----------
        name : str
            Of the word.
        function : callable
            Of the values of `words`.
        *words : Word
            What it is made from.
        since : int
            Earliest stage of the word: a word that is read late needs no copies before.
        """
        stage = max(since - 1, *(word.stage for word in words))

        def make(build):
            value = function(*(build.at(word, stage) for word in words))
            return build.unit.register(build.m, value, name, when=build.when(stage))

        return self._add(name, stage + 1, self.interval, make)

    def share(
        self, name: str, uses: int, shapes: Sequence[ShapeLike], latency: int, make: Callable[..., Any]
    ) -> FunctionalUnit:
        """A functional unit for so many uses; the parameters are those of `FunctionalUnit`."""
        instances = -(-uses // self.interval)
        return FunctionalUnit(name, shapes, latency, make, [uses], [set() for _ in range(instances)])

    def _serves(self, taken: set[int], stage: int) -> bool:
        """Whether an instance with uses at these stages serves one more, in any two beats."""
        if self.spaced:
            return stage not in taken and max(taken | {stage}) - min(taken | {stage}) < self.interval
        return all((stage - other) % self.interval for other in taken)

    def _place(self, functional_unit: FunctionalUnit, stage: int) -> tuple[int, int]:
        """Instance and stage of a use, at the earliest from a stage on."""
        for later in range(stage, stage + 2 * self.interval):
            for instance, taken in enumerate(functional_unit.taken):
                if self._serves(taken, later):
                    taken.add(later)
                    return instance, later
        functional_unit.taken.append({stage})
        return functional_unit.count - 1, stage

    def use(
        self,
        functional_unit: FunctionalUnit,
        name: str,
        words: Sequence[Word],
        operands: Callable[..., Sequence[Any]],
        result: Callable[[Any], Any] = lambda value: value,
        latency: int | None = None,
        since: int = 0,
    ) -> Word:
        """Result of a functional unit; its lifetime is one cycle.

        Parameters
        ----------
        functional_unit : FunctionalUnit
            From `share`.
        name : str
            Of the word.
        words : sequence of Word
            What the operands are made from.
        operands : callable
            Wiring from the words' values to the operands.
        result : callable
            Wiring from the functional unit's result to the word's value.
        latency : int or None
            Registers from the operands to that value, where ``result`` takes one on the way; ``None``: all.
        since : int
            Earliest stage of the word, as for `register`.

        Raises
        ------
        ValueError
            If that is one use more than announced.
        """
        if not functional_unit.left[0]:
            raise ValueError(f"{name} is one use of the {functional_unit.name} more than announced")
        functional_unit.left[0] -= 1
        latency = functional_unit.latency if latency is None else latency
        stage = max(since - 1 - latency, *(word.stage for word in words))
        instance, stage = self._place(functional_unit, stage)

        def make(build):
            given = operands(*(build.at(word, stage) for word in words))
            return result(build.issue(functional_unit, instance, stage, given))

        return self._add(name, stage + 1 + latency, 1, make)

    def multiply(
        self,
        name: str,
        a: Word,
        b: Word,
        left: Callable[[Any], FixedValue] = lambda value: value,
        right: Callable[[Any], FixedValue] = lambda value: value,
        since: int = 0,
    ) -> Word:
        """Exact product of two words on a shared multiplier.

        Its stage is `MULTIPLIER_LATENCY` cycles after that of its operands; one in a graph of low latency.

        Parameters
        ----------
        name : str
            Of the word.
        a, b : Word
            Operands.
        left, right : callable
            Wiring from the value of a word to the operand: `MULTIPLIER_BITS` bits if signed, one less if not.
        since : int
            As for `use`.

        Raises
        ------
        ValueError
            If an operand has too many bits, or there are more multiplications than announced.
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

        return self.use(self.multiplier, name, (a, b), operands, product, since=since)

    def look_up(self, name: str, words: Sequence[int], width: int, address: Word) -> Word:
        """Word of a table at an address: one cycle.

        Parameters
        ----------
        name : str
            Of the table.
        words : sequence of int
            Of the table, a power of two of them.
        width : int
            Bits of each.
        address : Word
            As many bits as needed, unsigned.
        """
        stage = address.stage

        def make(build):
            memory = Memory(shape=width, depth=len(words), init=words)
            build.m.submodules[name] = memory
            port = memory.read_port()
            build.m.d.comb += port.addr.eq(build.at(address, stage))
            return port.data

        # The word that is read has the lifetime of the address.
        return self._add(name, stage + 1, address.lifetime, make)

    def build(self, m: Module, unit: PipelinedUnit, operands: Any) -> Callable[[Word, int], Any]:
        """Make the hardware; the result gives a word's value at a stage.

        Parameters
        ----------
        m : Module
            Module that gets the registers.
        unit : PipelinedUnit
            Unit whose beats they belong to; its initiation interval is that of the graph.
        operands
            What the unit's `PipelinedUnit.datapath` is given.
        """
        build = _Build(m, unit, operands)
        for word, make in self._makers:
            build.values[word] = {word.stage: make(build)}
        return build.at


def registered_product(register: Callable[[Any, str], Any], a: Any, b: Any) -> Any:
    """Exact product, `MULTIPLIER_LATENCY` cycles: two registers for each operand, two for the product.

    An FPGA's multipliers lie in few places, far from the multiplexers that operands come from and the adders
    that products go to. Of registers in a row each wire is short wherever those are; and some go into the
    multiplier block.

    Parameters
    ----------
    register : callable
        Makes a register: from a value and its name, the register.
    a, b
        Operands.
    """
    for step in range(2):
        a, b = register(a, f"a_{step}"), register(b, f"b_{step}")
    return register(register(a * b, "product_0"), "product")


def shared_sums(graph: Dataflow, uses: int, product: Format) -> FunctionalUnit:
    """What sums so many dot products, whose products have a format: two cycles; see `dot`."""
    shapes = FixedShape(product + product), FixedShape(product)
    return graph.share("sum", uses, shapes, 1, lambda register, x, y: register(x + y, "total"))


def dot(
    graph: Dataflow, name: str, a: Word, b: Word | Callable[[Any], Any], sums: FunctionalUnit | None = None
) -> Word:
    """Exact dot product of two vectors: three multiplications of the graph, and two sums.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    name : str
        Of the result.
    a : Word
        A vector.
    b : Word or callable
        The other; or what makes it from the value of ``a``.
    sums : Operator or None
        From `shared_sums`; ``None``: the sums have registers of their own.
    """

    def factors(c):
        if isinstance(b, Word):
            return a, b, lambda v: v[c], lambda v: v[c]
        return a, a, lambda v: v[c], lambda v: b(v)[c]

    products = [graph.multiply(f"{name}_{c}", *factors(c)) for c in range(3)]
    if sums is not None:
        return graph.use(sums, f"{name}_total", products, lambda x, y, z: (x + y, z))
    partial = graph.register(f"{name}_partial", lambda x, y: x + y, *products[:2])
    return graph.register(f"{name}_total", lambda x, y: x + y, partial, products[2])


def checked_interval(interval: int | None, longest: int, default: int | None = None) -> int:
    """An initiation interval from 1 to that of one multiplier for all; ``None`` means the default.

    Raises
    ------
    ValueError
        If it is out of range.
    """
    if interval is None:
        return default or longest
    if interval not in range(1, longest + 1):
        raise ValueError(f"initiation_interval must be 1 to {longest}, not {interval!r}")
    return interval


class _Build:
    """Hardware of a graph while it is being made."""

    def __init__(self, m: Module, unit: PipelinedUnit, operands: Any):
        self.m, self.unit, self.operands = m, unit, operands
        self.values: dict[Word, dict[int, Any]] = {}
        self._instances: dict[tuple[FunctionalUnit, int], tuple[list[Signal], Any]] = {}

    def when(self, stage: int) -> Value | None:
        """When a register of that stage is written; always where a beat may come on every cycle."""
        return self.unit.at(stage) if self.unit.initiation_interval > 1 else None

    def at(self, word: Word, stage: int) -> Any:
        """Value of a word at a stage, through copies after its lifetime."""
        copies = self.values[word]
        first = max(copies)
        lifetime = word.lifetime if first == word.stage else self.unit.initiation_interval
        while stage >= first + lifetime:
            value = copies[first]
            first += lifetime
            copies[first] = self.unit.register(
                self.m, value, f"{word.name}_{first}", when=self.when(first - 1)
            )
            lifetime = self.unit.initiation_interval
        return copies[max(start for start in copies if start <= stage)]

    def issue(
        self, functional_unit: FunctionalUnit, instance: int, stage: int, operands: Sequence[Any]
    ) -> Any:
        """Issue operands to an instance of a functional unit at a stage; its result, for all uses.

        Those of the first use are issued on every cycle of no other use, so that no register needs an enable.
        """
        key, when = (functional_unit, instance), self.when(stage)
        if key not in self._instances:
            when = None
            given = [
                Signal(shape, name=f"{functional_unit.name}_{instance}_{k}", reset_less=True)
                for k, shape in enumerate(functional_unit.shapes)
            ]

            def register(value, name):
                return self.unit.register(self.m, value, f"{functional_unit.name}_{instance}_{name}")

            self._instances[key] = given, functional_unit.make(register, *given)
        given, result = self._instances[key]
        assignments = [
            Value.cast(to).eq(Value.cast(value)) for to, value in zip(given, operands, strict=True)
        ]
        if when is None:
            self.m.d.sync += assignments
        else:
            with self.m.If(when):
                self.m.d.sync += assignments
        return result
