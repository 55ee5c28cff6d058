"""Registers moved into multipliers: which move, which stay, and proofs that the netlist does the same."""

import copy
import json

import pytest
from amaranth.hdl import Cat, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.bench.tools.absorb_registers import Absorbed, absorb_registers
from blysk.bench.tools.place_and_route import tool_versions

from ...simulators.mapped import connect, first, map_component, same, swap

pytestmark = pytest.mark.skipif(tool_versions()["pyosys"] is None, reason="pyosys is not installed")


class Beside(wiring.Component):
    """Products of two operands, with registers as a function describes them, and the results of this
    function."""

    a: In(signed(18))
    b: In(signed(18))
    enable: In(2)
    o: Out(36)
    other: Out(36)

    def __init__(self, describe):
        super().__init__()
        self._describe = describe

    def elaborate(self, platform):
        m = Module()
        given = [self.register(m, value, name) for value, name in ((self.a, "a_0"), (self.b, "b_0"))]
        given.append(self.register(m, self.enable, "enables"))
        product, *other = self._describe(lambda *args, **options: self.register(m, *args, **options), *given)
        m.d.comb += self.o.eq(self.register(m, product, "last"))
        m.d.comb += [self.other.eq(self.register(m, value, "other_last")) for value in other]
        return m

    @staticmethod
    def register(m, value, name, when=None, reset_less=True, init=0):
        register = Signal(signed(len(value)), name=name, reset_less=reset_less, init=init)
        if when is None:
            m.d.sync += register.eq(value)
        else:
            with m.If(when):
                m.d.sync += register.eq(value)
        return register


def product(a_options=None, b_options=None, options=None, also=lambda a, b, p, register: ()):
    """A product between registers with options."""

    def describe(register, a, b, enable):
        def chosen(given):
            given = dict(given or {})
            if "when" in given:
                given["when"] = given["when"](enable)
            return given

        a, b = register(a, "a_1", **chosen(a_options)), register(b, "b_1", **chosen(b_options))
        p = register(a * b, "p_0", **chosen(options))
        return p, *also(a, b, p, register)

    return describe


def square(register, a, b, enable):
    a = register(a, "a_1")
    return (register(a * a, "p_0"),)


def shared(register, a, b, enable):
    """One register serves two multipliers."""
    a, b, c = register(a, "a_1"), register(b, "b_1"), register(~b, "c_1")
    return register(a * b, "p_0"), register(a * c, "p_1")


def half_enabled(register, a, b, enable):
    """An operand has two halves, and one of them is enabled."""
    low, high = register(a[:9], "low"), register(a[9:], "high", when=enable[0])
    return (register(Cat(low, high).as_signed() * register(b, "b_1"), "p_0"),)


def narrow(register, a, b, enable):
    """Operands have no sign and fewer bits, with 0 above."""
    a, b = register(a[:9], "a_1").as_unsigned(), register(b[:12], "b_1").as_unsigned()
    return (register(a * b, "p_0"),)


def behind_logic(register, a, b, enable):
    """A register that may move is behind gates, so nextpnr treats the operand as without register."""
    return (register(register(a ^ b, "a_1") * register(b, "b_1", reset_less=False), "p_0"),)


def chained(register, a, b, enable):
    """One register is between two multipliers, and goes into one of them."""
    between = register((a * b)[18:].as_signed(), "between")
    return (register(between * register(b, "b_1"), "p_0"),)


FIRST, INVERTED = {"when": lambda enable: enable[0]}, {"when": lambda enable: ~enable[0]}
SECOND = {"when": lambda enable: enable[1]}
WITH_RESET = {"reset_less": False}

CASES = {
    "no enable": (product(), Absorbed(2, 1, 72, 0, 1)),
    "an enable": (product(FIRST, FIRST, FIRST), Absorbed(2, 1, 72, 0, 1)),
    "an inverted enable": (product(INVERTED, INVERTED, INVERTED), Absorbed(2, 1, 72, 1, 1)),
    "three enables": (product(FIRST, SECOND, INVERTED), Absorbed(2, 1, 72, 1, 1)),
    "enabled product": (product(options=SECOND), Absorbed(2, 1, 72, 0, 1)),
    "a reset": (product(WITH_RESET), Absorbed(1, 1, 54, 0, 0)),
    "a reset of the product": (product(options=WITH_RESET), Absorbed(2, 0, 36, 0, 0)),
    "a value at power-up": (product({"init": 5}), Absorbed(1, 1, 54, 0, 0)),
    "another reader of an operand": (product(also=lambda a, b, p, r: (a,)), Absorbed(2, 1, 54, 0, 1)),
    "another reader of the product": (
        product(also=lambda a, b, p, r: (r((a * b) ^ 1, "q"),)),
        Absorbed(2, 0, 36, 0, 0),
    ),
    "a square": (square, Absorbed(2, 1, 54, 0, 1)),
    "a shared operand": (shared, Absorbed(4, 2, 18 * 3 + 72, 0, 2)),
    "halves of different enables": (half_enabled, Absorbed(1, 1, 54, 0, 0)),
    "narrow operands": (narrow, Absorbed(2, 1, 9 + 12 + 21, 0, 1)),
    "one operand, behind logic": (behind_logic, Absorbed(0, 1, 36, 0, 0)),
    "no register at hand": (lambda register, a, b, enable: (a * b,), Absorbed()),
}


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """Netlist of a case, made once."""
    made = {}

    def mapped(name, component):
        if name not in made:
            made[name] = map_component(component, tmp_path_factory.mktemp("mapped"))
        return copy.deepcopy(made[name])

    return mapped


class Read(wiring.Component):
    """A table that is read with an enable. The register behind it has another enable, or the same."""

    address: In(9)
    enable: In(2)
    o: Out(36)
    other: Out(36)

    def __init__(self, when=lambda enable: enable[0], also=False, behind=None, **options):
        super().__init__()
        self._when, self._behind, self._also, self._options = when, behind or when, also, options

    def elaborate(self, platform):
        m = Module()
        words = [k * 0x5DEECE66D % 2**36 for k in range(512)]
        m.submodules.words = memory = Memory(shape=36, depth=512, init=words)
        port = memory.read_port()
        address, enable = (
            Beside.register(m, value, name).as_unsigned()
            for value, name in ((self.address, "address_0"), (self.enable, "enables"))
        )
        m.d.comb += [port.addr.eq(address), port.en.eq(self._when(enable))]
        word = Beside.register(m, port.data, "word", when=self._behind(enable), **self._options)
        m.d.comb += self.o.eq(Beside.register(m, word, "last"))
        if self._also:
            m.d.comb += self.other.eq(Beside.register(m, ~port.data, "other_last"))
        return m


READS = {
    "the same enable": (Read(), 1),
    "none": (Read(lambda enable: 1), 1),
    "the same inverted enable": (Read(lambda enable: ~enable[0]), 1),
    "another enable": (Read(behind=lambda enable: enable[1]), 0),
    "the other polarity": (Read(behind=lambda enable: ~enable[0]), 0),
    "an enable of the register alone": (Read(lambda enable: 1, behind=lambda enable: enable[0]), 0),
    "an enable of the memory alone": (Read(behind=lambda enable: 1), 0),
    "a reset": (Read(reset_less=False), 0),
    "a value at power-up": (Read(init=5), 0),
    "another reader": (Read(also=True), 0),
}
"""Tables, and the number of their words with a register inside."""


def often(names, some):
    """Names, for the long run. CI has some of them."""
    return [
        pytest.param(name, marks=[pytest.mark.long] + [pytest.mark.ci] * (name in some)) for name in names
    ]


@pytest.mark.parametrize("name", often(READS, ("another enable",)))
def test_registers_behind_a_memory(name, mapped, tmp_path):
    component, words = READS[name]
    before = mapped(f"read, {name}", component)
    after, found = absorb_registers(before)
    assert found == Absorbed(removed=36 * words, words=words)
    assert not words or same(before, after, tmp_path) == ""


MEMORY_FAULTS = {
    "never enabled": lambda cell: connect(cell, "OCEB", "0"),
    "register always enabled": lambda cell: connect(cell, "OCEB", "1"),
    "no register of a half": lambda cell: cell["parameters"].update(REGMODE_A="NOREG"),
    "another address": lambda cell: swap(cell, "ADB5", "ADB6"),
    "swapped bits": lambda cell: swap(cell, "DOB5", "DOB6"),
}


@pytest.mark.parametrize("fault", often(MEMORY_FAULTS, ("register always enabled",)))
def test_faults_injected_in_a_memory_are_found(fault, mapped, tmp_path):
    name = "the same enable"
    before = mapped(f"read, {name}", READS[name][0])
    after = copy.deepcopy(absorb_registers(before)[0])
    MEMORY_FAULTS[fault](first(after["modules"]["top"]["cells"], "DP16KD"))
    assert "not shown to be equal" in same(before, after, tmp_path)


class Adds(wiring.Component):
    """A sum, which loses its carry, and a comparison, whose result is the carry."""

    a: In(12)
    b: In(12)
    o: Out(12)
    less: Out(1)

    def elaborate(self, platform):
        m = Module()
        a, b = (Beside.register(m, value, name) for value, name in ((self.a, "a_0"), (self.b, "b_0")))
        m.d.comb += [
            self.o.eq(Beside.register(m, a + b, "sum")),
            self.less.eq(Beside.register(m, a.as_unsigned() < b.as_unsigned(), "less_0")),
        ]
        return m


@pytest.mark.long
def test_carries_that_nobody_reads(tmp_path):
    before = map_component(Adds(), tmp_path)
    after, found = absorb_registers(before)
    assert found == Absorbed(carries=1)
    # The carry is not that of the comparison; a net without a driver would show this.
    assert _unread(after) == "" != _unread(before)
    assert same({**before}, after, tmp_path) in ("", "0 of 0 nets are not shown to be equal")


def _unread(netlist):
    """Carries without a reader."""
    cells = netlist["modules"]["top"]["cells"].values()
    ports = [
        (cell["port_directions"][p], bit)
        for cell in cells
        for p, b in cell["connections"].items()
        for bit in b
    ]
    read = {bit for direction, bit in ports if direction == "input"}
    carries = [cell["connections"]["COUT"][0] for cell in cells if cell["type"] == "CCU2C"]
    return "".join(f"{bit} " for bit in carries if isinstance(bit, int) and bit not in read)


def multipliers(netlist):
    return [cell for cell in netlist["modules"]["top"]["cells"].values() if cell["type"] == "MULT18X18D"]


@pytest.mark.parametrize("name", often(CASES, ("three enables",)))
def test_what_moves_and_that_nothing_else_changes(name, mapped, tmp_path):
    describe, expected = CASES[name]
    before = mapped(name, Beside(describe))
    text = json.dumps(before)
    after, found = absorb_registers(before)
    assert json.dumps(before) == text
    assert found == expected
    cells = [netlist["modules"]["top"]["cells"] for netlist in (before, after)]
    assert len(cells[0]) - len(cells[1]) == found.removed - found.inverters
    if found.products:
        assert same(before, after, tmp_path) == ""
    else:
        assert found.operands == 0 or same(before, after, tmp_path) == ""


@pytest.mark.long
def test_a_register_between_two_multipliers_goes_into_one(mapped, tmp_path):
    before = mapped("chained", Beside(chained))
    after, found = absorb_registers(before)
    assert found.operands + found.products == 3
    assert same(before, after, tmp_path) == ""


@pytest.mark.ci
@pytest.mark.long
def test_registers_at_ports_stay(mapped, tmp_path):
    """Registers at ports stand for those of other units."""

    class AtPorts(wiring.Component):
        a: In(signed(18))
        b: In(signed(18))
        o: Out(36)

        def elaborate(self, platform):
            m = Module()
            a, b = (Beside.register(m, value, name) for value, name in ((self.a, "a_0"), (self.b, "b_0")))
            m.d.comb += self.o.eq(Beside.register(m, a * b, "p_0"))
            return m

    before = map_component(AtPorts(), tmp_path)
    after, found = absorb_registers(before)
    assert found == Absorbed()
    assert after == before


@pytest.mark.long
def test_controls_of_a_multiplier(mapped):
    """There is a clock, no reset, and an enable for each register.

    A register without enable gets a constant.
    """
    (cell,) = multipliers(absorb_registers(mapped("three enables", Beside(CASES["three enables"][0])))[0])
    assert cell["parameters"]["RESETMODE"] == "SYNC"
    assert cell["connections"]["RST0"] == ["0"]
    enables = {enable_of(cell, name) for name in ("INPUTA", "INPUTB", "OUTPUT")}
    assert enables == {"CE0", "CE1", "CE2"}
    assert len({cell["connections"][name][0] for name in enables}) == 3
    (cell,) = multipliers(absorb_registers(mapped("enabled product", Beside(CASES["enabled product"][0])))[0])
    assert {cell["connections"][enable_of(cell, f"INPUT{x}")][0] for x in "AB"} == {"1"}
    assert cell["connections"][enable_of(cell, "OUTPUT")] != ["1"]


def enable_of(cell, register):
    return cell["parameters"][f"REG_{register}_CE"]


FAULTS = {
    "swapped operand bits": lambda cell: swap(cell, "A3", "A4"),
    "enable of another": lambda cell: cell["parameters"].update(REG_INPUTA_CE=enable_of(cell, "INPUTB")),
    "in reset": lambda cell: connect(cell, "RST0", "1"),
    "swapped product bits": lambda cell: swap(cell, "P7", "P8"),
    "always enabled": lambda cell: connect(cell, enable_of(cell, "OUTPUT"), "1"),
    "no register": lambda cell: cell["parameters"].update(REG_INPUTB_CLK="NONE"),
    "unsigned operand": lambda cell: connect(cell, "SIGNEDA", "0"),
}


@pytest.mark.parametrize("fault", often(FAULTS, ("enable of another",)))
def test_injected_faults_are_found(fault, mapped, tmp_path):
    before = mapped("three enables", Beside(CASES["three enables"][0]))
    after, _ = absorb_registers(before)
    after = copy.deepcopy(after)
    (cell,) = multipliers(after)
    FAULTS[fault](cell)
    assert "not shown to be equal" in same(before, after, tmp_path)


@pytest.mark.ci
@pytest.mark.long
def test_a_register_of_another_reader_that_is_removed_is_found(mapped, tmp_path):
    name = "another reader of an operand"
    before = mapped(name, Beside(CASES[name][0]))
    after = copy.deepcopy(absorb_registers(before)[0])
    cells = after["modules"]["top"]["cells"]
    kept = next(cell for cell in cells if cell.startswith("a_1_TRELLIS_FF"))
    del cells[kept]
    assert same(before, after, tmp_path) == "1 nets without a driver"


@pytest.mark.long
def test_an_inverter_that_does_not_invert_is_found(mapped, tmp_path):
    name = "an inverted enable"
    before = mapped(name, Beside(CASES[name][0]))
    after = copy.deepcopy(absorb_registers(before)[0])
    old, new = (netlist["modules"]["top"]["cells"] for netlist in (before, after))
    (inverter,) = new.keys() - old.keys()
    new[inverter]["parameters"]["INIT"] = f"{0xAAAA:016b}"
    assert "not shown to be equal" in same(before, after, tmp_path)


@pytest.mark.ci
@pytest.mark.long
def test_a_power_up_value_that_is_lost_is_found(mapped, tmp_path):
    """The netlist is the same, except for a register that starts at 1.

    Inside a multiplier it would start at 0.
    """
    before = mapped("no enable", Beside(CASES["no enable"][0]))
    after, _ = absorb_registers(before)
    for name, cell in before["modules"]["top"]["cells"].items():
        if name.startswith("a_1_TRELLIS_FF"):
            cell["parameters"]["REGSET"] = "SET"
    assert "not shown to be equal" in same(before, after, tmp_path)
