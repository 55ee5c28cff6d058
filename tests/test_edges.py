"""The list of edges, ``docs/edges.md``: its devices, their input bits, and the tests and numbers it names."""

import ast
import gc
import re
import warnings
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from amaranth.hdl import UnusedElaboratable, Value
from amaranth.lib.wiring import In

from bench.blocks import BLOCKS
from bench.mutants import DEVICES as TESTED

from .simulators import test_devices as long_run
from .simulators.devices import DEVICES

PROJECT = Path(__file__).parents[1]
PAGE = PROJECT / "docs" / "edges.md"
TEXT = PAGE.read_text(encoding="utf-8")
# What every row may name, beside the tests of its device.
SHARED = tuple(PROJECT / "tests" / name for name in ("conftest.py", "simulators/devices.py"))
MOST_BITS = 18
"""A device with so many input bits or fewer is tested with every input."""

# A code span, and whether it is said to be of the long run.
NAMED = re.compile(r"`([^`]+)`( \(long\))?")


class Row(NamedTuple):
    """A row of the page's tables."""

    device: str
    file: Path
    bits: str
    how: str
    random: str

    @property
    def files(self) -> list[Path]:
        """Where the names of the row are looked up: its device's tests, and what is shared."""
        return [*(PROJECT / "tests" / "hdl" / name for name in TESTED[self.device].tests), *SHARED]


def rows():
    for line in TEXT.splitlines():
        if found := re.match(r"\| \[(\w+)\]\(([^)]+)\) \|", line):
            cells = [cell.strip() for cell in line.strip("|").split("|")[1:]]
            yield Row(found[1], (PAGE.parent / found[2]).resolve(), *cells)


ROWS = list(rows())
each_row = pytest.mark.parametrize("row", ROWS, ids=[row.device for row in ROWS])


@cache
def input_bits():
    """Bits of a beat, and of the constants or a write to them, of each variant of every device."""
    found = {}
    with warnings.catch_warnings():
        # Parts warn when they go without having been elaborated.
        warnings.simplefilter("ignore", UnusedElaboratable)
        for block in BLOCKS:
            unit = block.unit()
            members = unit.signature.members.items()
            ports = [getattr(unit, name) for name, member in members if member.flow is In]
            bits = tuple(len(Value.cast(getattr(port, "payload", port))) for port in ports)
            found.setdefault(block.device, {})[bits] = None
        del unit, ports
        gc.collect()
    return {device: list(variants) for device, variants in found.items()}


@cache
def functions(path):
    """Names of a file's functions, and whether all of a function is of the long run."""
    return {
        node.name: any(ast.unparse(decorator) == "pytest.mark.long" for decorator in node.decorator_list)
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }


@cache
def numbers(path):
    """Whole numbers that stand in a file."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return {int(n.value) for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, int | float)}


def is_long(name, files):
    """Whether a function that is named is of the long run; fails where there is none."""
    path, _, function = name.rpartition("::")
    found = [
        functions(file)[function]
        for file in ([PROJECT / path] if path else files)
        if function in functions(file)
    ]
    assert found, f"there is no {name}"
    return all(found)


def check_names(text, files):
    for name, said in NAMED.findall(text):
        if name.startswith("make "):
            assert f"\n{name.removeprefix('make ')}:" in (PROJECT / "Makefile").read_text(encoding="utf-8")
        elif name.endswith(".py"):
            assert (PROJECT / name).is_file()
        else:
            assert is_long(name, files) == bool(said), name


def test_every_device_has_a_row():
    """In the order of the device table."""
    assert [row.device for row in ROWS] == list(dict.fromkeys(block.device for block in BLOCKS))


@each_row
def test_input_bits(row):
    assert row.bits == " / ".join(" + ".join(map(str, ports)) for ports in input_bits()[row.device])


@each_row
def test_few_inputs_are_all_tested(row):
    few = max(map(sum, input_bits()[row.device])) <= MOST_BITS
    assert re.match(r"exhaustive|edges", row.how)[0] == ("exhaustive" if few else "edges")


@each_row
def test_names(row):
    """Functions of the device's tests, of which each column names some, and of what makes its long run."""
    assert row.file in row.files
    check_names(row.how, row.files)
    check_names(row.random, row.files)
    assert "test_" in row.how
    makers = [maker for name, maker in DEVICES.items() if name.split(", ")[0] == row.device]
    for maker in makers:
        assert f"`{getattr(maker, 'func', maker).__name__}`" in row.random


@each_row
def test_numbers(row):
    """From 100 on they, or the next as ranges have it, stand in the tests: a weak check, of stale numbers."""
    outside = [PROJECT / path for path in re.findall(r"`(\S+)::", row.how + row.random)]
    there = set().union(*map(numbers, [*row.files, *outside]))
    found = re.findall(r"(?<![\d^.])\d+(?:,\d{3})*(?!\.?\d)", f"{row.how} {row.random}")
    large = {number for text in found if (number := int(text.replace(",", ""))) >= 100}
    assert {number for number in large if not {number, number + 1} & there} == set()


def test_words():
    words = TEXT.partition("\n## Words\n")[2]
    for name in ("BEATS", "FEWER", "QUICK_BEATS"):
        words, count = re.subn(rf"{getattr(long_run, name):,}( beats)? \(`{name}`\)", "", words)
        assert count == 1, name
    for name in long_run.QUICK:
        assert f"`{name}`" in words
        words = words.replace(f"`{name}`", "")
    check_names(words, [*SHARED, Path(long_run.__file__)])


def test_links():
    links = re.findall(r"\]\(([^)]+)\)", TEXT)
    assert len(links) > len(ROWS)
    assert [link for link in links if not (PAGE.parent / link).is_file()] == []
