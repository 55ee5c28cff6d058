"""CXXRTL's C++ with the fields of combinational words read from their sources.

Amaranth joins the fields of a structure to a word. It passes the word on from unit to unit under new names,
and splits it where a field is used. This happens on every clock, even for frame constants of 271 bits.
`read_parts` follows each field to its source (a word or a register). It removes the words that are no longer
read. The driver reads the status in an evaluation without a clock edge. Only this evaluation computes it.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import NamedTuple

__all__ = ["NAME", "read_parts"]

NAME = r"\b[pi]_\w+"
"""Pattern of a name in CXXRTL's C++. ``p_`` precedes a name of the netlist, ``i_`` a generated name."""

_DECLARED = re.compile(rf"^\t+(?:/\*\w+\*/ )?(value|wire)<(\d+)> ({NAME})(?=;| \{{| =)", re.MULTILINE)
_LOCAL = re.compile(rf"\tvalue<\d+> ({NAME});")
_SLICE = r"\.slice<(\d+)(?:,(\d+))?>\(\)"
_ASSIGNMENT = re.compile(rf"\t({NAME})(?:{_SLICE})? = (.*);")
_COPY = re.compile(rf"({NAME}(?:\.curr)?)(?:{_SLICE}\.val\(\))?")
_READ = re.compile(rf"({NAME})(?:{_SLICE})?(?!\w)")


class _Part(NamedTuple):
    """Bits ``low`` to ``high`` of a word equal the bits of ``source`` from bit ``start`` on."""

    low: int
    high: int
    source: str
    start: int


class _Reader:
    """Sources of the bits of each word, as far as known from the statements so far."""

    def __init__(self, text: str):
        self.widths = {name: (kind, int(width)) for kind, width, name in _DECLARED.findall(text)}
        self.parts: dict[str, list[_Part]] = {}

    def width(self, source: str) -> int:
        return self.widths[source.removesuffix(".curr")][1]

    def found(self, name: str, low: int, high: int) -> _Part | None:
        """Source of bits ``low`` to ``high`` of a word.

        ``None`` if it is unknown, or if there are several sources.
        """
        for part in self.parts.get(name, ()):
            if part.low <= low and high <= part.high:
                return _Part(low, high, part.source, part.start + low - part.low)
        return None

    def read(self, text: str) -> str:
        """An expression in which each part with a known source is replaced by this source."""
        return _READ.sub(self._replaced, text)

    def _replaced(self, match: re.Match) -> str:
        name, last, first = match.groups()
        if name not in self.parts:
            return match[0]
        high = self.width(name) - 1 if last is None else int(last)
        low = 0 if last is None else int(first or last)
        part = self.found(name, low, high)
        if part is None:
            return match[0]
        stop = part.start + high - low
        if (part.start, stop) == (0, self.width(part.source) - 1):
            return part.source
        # `val()` makes the slice a value. It is needed where the whole word stood before.
        return f"{part.source}.slice<{stop},{part.start}>()" + (".val()" if last is None else "")

    def statements(self, line: str) -> Iterator[str]:
        """Rewritten lines for a statement of ``eval``.

        The sources of the word that it assigns are recorded.
        """
        match = _ASSIGNMENT.fullmatch(line)
        kind, width = self.widths.get(match[1], ("", 0)) if match else ("", 0)
        if kind != "value":
            target, equals, value = line.rpartition(" = ") if line.endswith(";") else ("", "", line)
            yield target + equals + self.read(value)
            return
        name, last, first, value = match.groups()
        high, low = (width - 1, 0) if last is None else (int(last), int(first or last))
        value = self.read(value)
        copy = _COPY.fullmatch(value)
        if copy is None or copy[1].removesuffix(".curr") not in self.widths:
            if last is None:
                yield f"\t{name} = {value};"
                return
            # The field becomes a word of its own, with a name that CXXRTL does not use.
            source = f"{name}_at_{low}"
            self.widths[source] = ("value", high - low + 1)
            yield f"\tvalue<{high - low + 1}> {source};"
            yield f"\t{source} = {value};"
            value, sources = source, [_Part(low, high, source, 0)]
        else:
            start = int(copy[3] or copy[2] or 0)
            sources = list(self._sources(copy[1], start, low, high))
        self.parts.setdefault(name, []).extend(sources)
        place = "" if last is None else f".slice<{high},{low}>()"
        yield f"\t{name}{place} = {value};"

    def _sources(self, source: str, start: int, low: int, high: int) -> Iterator[_Part]:
        """Parts of a word whose bits ``low`` to ``high`` equal bits of ``source``, from bit ``start`` on.

        If all sources of these bits of ``source`` are known, the parts name these sources.
        """
        known = self.parts.get(source, ())
        stop = start + high - low
        inside = [part for part in known if part.high >= start and part.low <= stop]
        if sum(min(part.high, stop) - max(part.low, start) + 1 for part in inside) != high - low + 1:
            yield _Part(low, high, source, start)
            return
        for part in inside:
            first, last = max(part.low, start), min(part.high, stop)
            shift = low - start
            yield _Part(first + shift, last + shift, part.source, part.start + first - part.low)


def read_parts(text: str) -> str:
    """Rewrite the C++ of `write_cxxrtl` so that fields are read from their sources.

    The behaviour stays the same: a combinational word is written once, before it is read, and registers
    change only in ``commit``. A word that is written under a condition is not followed to its sources.

    Parameters
    ----------
    text : str
        C++ with one clock and one evaluation a clock, without debug information.

    Returns
    -------
    str
        C++ with the same class.
    """
    start = text.find("bool p_top::eval(")
    end = text.find("\treturn converged;", start)
    if start < 0 or end < 0:
        return text
    reader = _Reader(text)
    lines = [new for line in text[start:end].split("\n") for new in reader.statements(line)]
    return text[:start] + "\n".join(_late(_used(lines))) + text[end:]


def _late(lines: list[str]) -> list[str]:
    """Move the status, and local words that only the status needs, under a test for no clock edge."""
    local = {match[1] for line in lines if (match := _LOCAL.fullmatch(line))}
    assignments = {k: match for k, line in enumerate(lines) if (match := _ASSIGNMENT.fullmatch(line))}
    late, readers = {"p_status"}, defaultdict(set)
    for k, line in enumerate(lines):
        match = assignments.get(k)
        for name in re.findall(NAME, match[4] if match else "" if _LOCAL.fullmatch(line) else line):
            readers[name].add(match[1] if match else "")
    while more := {name for name in local - late if readers[name] and readers[name] <= late}:
        late |= more
    first = next((k for k, line in enumerate(lines) if line.startswith("\tif (posedge_p_clk)")), len(lines))
    moved = [f"\t{lines[k]}" for k, match in assignments.items() if match[1] in late]
    if not moved:
        return lines
    kept = [
        line for k, line in enumerate(lines[:first]) if k not in assignments or assignments[k][1] not in late
    ]
    return [*kept, "\tif (!posedge_p_clk) {", *moved, "\t}", *lines[first:]]


def _used(lines: list[str]) -> list[str]:
    """Lines without the local words that are written but not read."""
    local = {match[1] for line in lines if (match := _LOCAL.fullmatch(line))}
    while True:
        read = set()
        for line in lines:
            match = _ASSIGNMENT.fullmatch(line)
            if not _LOCAL.fullmatch(line):
                read.update(re.findall(NAME, match[4] if match and match[1] in local else line))
        unread = local - read
        if not unread:
            return lines
        local -= unread
        lines = [
            line
            for line in lines
            if not ((match := _LOCAL.fullmatch(line) or _ASSIGNMENT.fullmatch(line)) and match[1] in unread)
        ]
