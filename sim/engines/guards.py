"""CXXRTL's C++ with register updates grouped by their conditions, and registers written in place.

CXXRTL gives every register a statement of its own, ``r.next = (rst ? 0 : (advance ? d : r.curr))``, and
copies every register on every clock. Most of a pipeline stands still most of the time, and most registers
have the same few conditions. `group_registers` tests each condition once. It orders the statements so that
the readers of a register come before its writer. Then the register needs no copy from ``next``.

In the names of this module a condition is a *question*, and its two results are the *answers*.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from blysk.sim.engines.parts import NAME

__all__ = ["group_registers"]

_CLOCK = "\tif (posedge_p_clk) {"
_RESET = "p_rst"
_READ = re.compile(rf"({NAME})\.curr\b")
_WRITE = re.compile(
    rf"^(\t+)(\w+\.update\(\w+\.index, (.*), ({NAME}(?:\.curr)?)\.repeat<\d+>\(\)\.val\(\), \d+\);)$",
    re.MULTILINE,
)
_UPDATE = re.compile(
    rf"\b(memory_\w+)\.update\((\w+\.index, .*?)(?:, {NAME}(?:\.curr)?\.repeat<\d+>\(\)\.val\(\))?, \d+\);"
)
_OUTPUT = re.compile(r"^\t/\*output\*/ wire<\d+> (\w+)", re.MULTILINE)


def _choice(text: str) -> tuple[str, str, str] | None:
    """The three parts of the text ``(question ? yes : no)``; ``None`` for any other text."""
    if not text.startswith("("):
        return None
    depth, question, colon = 0, None, None
    for match in re.finditer(r"[(){}]| \? | : ", text):
        token = match[0]
        if token in "({":
            depth += 1
        elif token in ")}":
            depth -= 1
            if depth == 0 and match.end() != len(text):
                return None
        elif depth == 1 and token == " ? " and question is None:
            question = match
        elif depth == 1 and token == " : " and question is not None and colon is None:
            colon = match
    if question is None or colon is None or depth:
        return None
    return text[1 : question.start()], text[question.end() : colon.start()], text[colon.end() : -1]


@dataclass
class _Item:
    """A statement: an assignment to a register or its ``field``, or a condition with a block for each result.

    ``text`` is the assigned value, or the condition; ``answers`` are the blocks for true and for false.
    """

    text: str
    register: str = ""
    field: str = ""
    answers: tuple["_Block", ...] = ()

    @cached_property
    def reads(self) -> set[str]:
        """Registers that the statement reads."""
        inner = (item.reads for block in self.answers for item in block.items)
        return set(_READ.findall(self.text)).union(*inner)

    @cached_property
    def writes(self) -> set[str]:
        """Registers that the statement writes."""
        inner = (item.writes for block in self.answers for item in block.items)
        return ({self.register} if self.register else set()).union(*inner)


@dataclass
class _Block:
    """Statements under the same results of conditions. ``questions``: the conditional statements, by text."""

    items: list[_Item] = field(default_factory=list)
    questions: dict[str, _Item] = field(default_factory=dict)

    def add(self, register: str, value: str, field: str = "") -> None:
        choice = _choice(value)
        if choice is None:
            if value != f"{register}.curr" + (f"{field}.val()" if field else ""):
                self.items.append(_Item(value, register, field))
            return
        question, yes, no = choice
        if question == _RESET:
            self.add(register, no, field)
            return
        if question not in self.questions:
            self.questions[question] = _Item(question, answers=(_Block(), _Block()))
            self.items.append(self.questions[question])
        for answer, text in zip(self.questions[question].answers, (yes, no), strict=True):
            answer.add(register, text, field)

    def order(self, buffered: set[str]) -> None:
        """Order the statements. All statements that read a register come before the statement that writes it.

        This is impossible if statements depend on each other in a cycle. Then the statement goes first for
        which the fewest registers must be copied. These registers are added to ``buffered``.
        """
        readers = defaultdict(set)
        for k, item in enumerate(self.items):
            for register in item.reads:
                readers[register].add(k)
        # For each statement, the registers that it writes and that other statements still read.
        waits = {
            k: {name for name in item.writes if name not in buffered and readers[name] - {k}}
            for k, item in enumerate(self.items)
        }
        writers = defaultdict(set)
        for k, names in waits.items():
            for name in names:
                writers[name].add(k)
        ready = [k for k, names in waits.items() if not names]
        order = []
        while waits:
            if not ready:
                fewest = min(waits, key=lambda k: len(waits[k]))
                buffered |= waits[fewest]
                waits[fewest].clear()
                ready.append(fewest)
            k = ready.pop()
            del waits[k]
            order.append(self.items[k])
            for name in sorted(self.items[k].reads):
                readers[name].discard(k)
                for writer in sorted(writers[name] & waits.keys()):
                    if name in waits[writer] and not readers[name] - {writer}:
                        waits[writer].remove(name)
                        if not waits[writer]:
                            ready.append(writer)
        self.items = order
        for item in order:
            for block in item.answers:
                block.order(buffered)

    def lines(self, indent: str, buffered: set[str]) -> Iterator[str]:
        """C++ of the statements; registers in ``buffered`` are written as ``next``, others as ``curr``."""
        for item in self.items:
            if item.register:
                place = "next" if item.register in buffered else "curr"
                yield f"{indent}{item.register}.{place}{item.field} = {item.text};"
                continue
            yes, no = (list(block.lines(indent + "\t", buffered)) for block in item.answers)
            if yes:
                yield from (f"{indent}if (bool({item.text})) {{", *yes)
                yield from (f"{indent}}} else {{", *no) if no else ()
                yield f"{indent}}}"
            elif no:
                yield from (f"{indent}if (!bool({item.text})) {{", *no, f"{indent}}}")


def _guard_writes(text: str) -> str:
    """Put each memory write under a test of its enable, with the assignments that only this write needs.

    CXXRTL makes the word and calls ``update`` on every clock, with the enable repeated as a mask. This move
    changes nothing, because at the edge memories are written before registers. The registers still have their
    old values then.
    """

    def guarded(match: re.Match) -> str:
        indent, write, word, enable = match.groups()
        parts = [line for name in sorted(set(re.findall(NAME, word))) for line in made.lines(name)[1:]]
        lines = (f"{indent}\t{line.strip()}\n" for line in [*parts, write])
        moved.update(parts)
        return f"{indent}if (bool({enable})) {{\n{''.join(lines)}{indent}}}"

    made, moved = _Made(text), set()
    text = _WRITE.sub(guarded, text)
    return "\n".join(line for line in text.split("\n") if line not in moved)


def _write_at_once(text: str) -> tuple[str, set[str]]:
    """Replace ``update`` by ``write`` for each memory with one write port. Also returns the memories' names.

    ``write`` changes the memory at once. All statements that read a memory come before it. A mask that
    repeats one enable bit is dropped, because `_guard_writes` has put the write under a test of this bit.
    """
    counts = Counter(match[1] for match in _UPDATE.finditer(text))
    memories = {name for name, count in counts.items() if count == 1}
    return _UPDATE.sub(lambda m: f"{m[1]}.write({m[2]});" if m[1] in memories else m[0], text), memories


class _Made:
    """The lines of an evaluation that declare and assign each word."""

    def __init__(self, text: str):
        self._counts = Counter(re.findall(NAME, text))
        self._lines: dict[str, list[str]] = {}
        for line in text.split("\n"):
            if match := re.match(rf"\t(?:value<\d+> )?({NAME})[.; ]", line):
                self._lines.setdefault(match[1], []).append(line)

    def lines(self, word: str) -> list[str]:
        """Lines that declare and assign a word that is read once. Other words have no lines here."""
        lines = self._lines.get(word, [])
        if not lines or not re.fullmatch(rf"\tvalue<\d+> {word};", lines[0]):
            return []
        return lines if self._counts[word] == len(lines) + 1 else []

    def fields(self, word: str) -> tuple[list[tuple[str, str]], set[str]]:
        """Fields and their values of a word that is read once, and the lines that make them.

        Both are empty if a field is not a word that is read once, or the fields do not cover the word.
        """
        if not (lines := self.lines(word)):
            return [], set()
        found, made, bits = [], set(lines), 0
        for line in lines[1:]:
            store = re.fullmatch(rf"\t{word}\.slice<(\d+),(\d+)>\(\) = ({NAME});", line)
            piece = self.lines(store[3]) if store else []
            if len(piece) != 2 or not piece[1].startswith(f"\t{store[3]} = "):
                return [], set()
            high, low = int(store[1]), int(store[2])
            bits += high - low + 1
            place = f"{high},{low}" if high > low else f"{high}"
            found.append((f".slice<{place}>()", piece[1].partition(" = ")[2].removesuffix(";")))
            made.update(piece)
        return (found, made) if lines[0] == f"\tvalue<{bits}> {word};" else ([], set())


def group_registers(text: str) -> str:
    """Rewrite the C++ of `write_cxxrtl`, with register updates grouped by condition, and written in place.

    If each field of a register has a value of its own, the fields are updated one by one. A memory's word is
    made only where it is written. A memory with one write port is written in place, too, after all statements
    that read it. The rewritten model behaves the same, for four reasons:

    - The statements at the edge read old register values and combinational values. The combinational values
      are complete before the first statement at the edge. So the order of these statements is free, and a
      register that no later statement reads may take its next value.
    - Before every evaluation, ``next`` of a copied register equals its ``curr``. So the statement ``r.next =
      r.curr`` may be left out.
    - The driver reads outputs before the copies. So registers that are outputs are copied.
    - The reset is an input that the driver never sets, so it is always 0.

    A text or a statement for which this cannot be shown stays as it is.

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
    first = text.find(_CLOCK, start)
    end = text.find("\treturn converged;", first)
    if start < 0 or first < 0 or end < 0:
        return text
    if _edge_blocks(text[first:end]) is None:
        return text
    text = text[:start] + _guard_writes(text[start:end]) + text[end:]
    first = text.find(_CLOCK, start)
    end = text.find("\treturn converged;", first)
    blocks = _edge_blocks(text[first:end])
    writes: dict[str, int] = {}
    for name in re.findall(rf"({NAME})\.next\b", text[start:end]):
        writes[name] = writes.get(name, 0) + 1
    tree, registers, others = _Block(), set(), []
    made, gone = _Made(text[start:end]), set()
    for block in blocks:
        match = re.fullmatch(rf"\t\t({NAME})\.next = (.*);", block) if "\n" not in block else None
        if match and writes[match[1]] == 1 and text.count(_copy(match[1])) == 1:
            found, lines = made.fields(match[2]) if re.fullmatch(NAME, match[2]) else ([], set())
            for place, value in found or [("", match[2])]:
                tree.add(match[1], value, place)
            gone |= lines
            registers.add(match[1])
        else:
            others.append(f"{_CLOCK}\n{block}\n\t}}\n")
    buffered = set(_OUTPUT.findall(text))
    tree.order(buffered)
    others.sort(key=lambda block: ".update(" in block)
    before, memories = _write_at_once("".join(others))
    edge = before + "\n".join([_CLOCK, *tree.lines("\t\t", buffered), "\t}\n"])
    values = "\n".join(line for line in text[start:first].split("\n") if line not in gone)
    text = text[:start] + values + edge + text[end:]
    for name in (registers - buffered) | memories:
        text = text.replace(_copy(name), "", 1)
    return text


def _copy(register: str) -> str:
    return f"\t\tif ({register}.commit(observer)) changed = true;\n"


def _edge_blocks(text: str) -> list[str] | None:
    """Bodies of the ``if`` statements at the clock's edge; ``None`` if there are other statements between."""
    blocks: list[str] = []
    body: list[str] | None = None
    for line in text.splitlines():
        if body is None:
            if line == _CLOCK:
                body = []
            elif not line.startswith("\t//"):
                return None
        elif line == "\t}":
            blocks.append("\n".join(body))
            body = None
        else:
            body.append(line)
    return None if body is not None else blocks
