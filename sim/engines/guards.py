"""CXXRTL's C++ with the registers put under what lets them change.

CXXRTL gives every register a statement of its own, ``r.next = (rst ? 0 : (advance ? d : r.curr))``, and
copies every register on every clock. Most of a pipeline stands still most of the time, and most registers ask
the same question. `group_registers` asks each question once, and copies on the next edge only what was under
a question that was answered with yes. The chord pipeline of one light becomes 1.7 times as fast.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["group_registers"]

_CLOCK = "\tif (posedge_p_clk) {"
_RESET = "p_rst"
_NAME = r"\b[pi]_\w+"

LEAST = 4
"""Registers under a question that get a copy of their own."""


def _choice(text: str) -> tuple[str, str, str] | None:
    """Question, yes and no of ``(question ? yes : no)``; ``None`` if the text is anything else."""
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
class _Block:
    """What is done under the same answers: assignments, and further questions with two blocks each."""

    assignments: list[tuple[str, str]] = field(default_factory=list)
    questions: dict[str, tuple[str, "_Block", "_Block"]] = field(default_factory=dict)

    def add(self, register: str, value: str, root: Callable[[str], str]) -> None:
        choice = _choice(value)
        if choice is None:
            if value != f"{register}.curr":
                self.assignments.append((register, value))
            return
        question, yes, no = choice
        key = re.sub(_NAME, lambda match: root(match[0]), question)
        if key == _RESET:
            self.add(register, no, root)
            return
        _, if_yes, if_no = self.questions.setdefault(key, (question, _Block(), _Block()))
        if_yes.add(register, yes, root)
        if_no.add(register, no, root)

    def registers(self) -> set[str]:
        below = (block.registers() for _, *blocks in self.questions.values() for block in blocks)
        return {register for register, _ in self.assignments}.union(*below)


class _Writer:
    """C++ of a tree of blocks, and under which flag each register is written."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.above: list[int | None] = []
        self.flags: dict[str, set[int | None]] = {}

    def write(self, block: _Block, indent: str, flag: int | None) -> None:
        for register, value in block.assignments:
            self.lines.append(f"{indent}{register}.next = {value};")
            self.flags.setdefault(register, set()).add(flag)
        for question, *answers in block.questions.values():
            for test, part in zip((f"bool({question})", f"!bool({question})"), answers, strict=True):
                count = len(part.registers())
                if not count:
                    continue
                self.lines.append(f"{indent}if ({test}) {{")
                inner = flag
                if count >= LEAST:
                    inner = len(self.above)
                    self.above.append(flag)
                    self.lines.append(f"{indent}\tchanged_{inner} = true;")
                self.write(part, indent + "\t", inner)
                self.lines.append(f"{indent}}}")

    def groups(self) -> list[list[str]]:
        """For each flag, the registers that need be copied only when it is set."""
        groups: list[list[str]] = [[] for _ in self.above]
        for register, flags in self.flags.items():
            chains = [self._chain(flag) for flag in flags]
            common = None
            for level in zip(*chains, strict=False):
                if len(set(level)) > 1:
                    break
                common = level[0]
            if common is not None:
                groups[common].append(register)
        return groups

    def _chain(self, flag: int | None) -> list[int]:
        chain = []
        while flag is not None:
            chain.append(flag)
            flag = self.above[flag]
        return chain[::-1]


def group_registers(text: str) -> str:
    """Rewrite the C++ of `write_cxxrtl` so that registers which share a question are written together.

    Three things make it the same machine. Before every evaluation ``next`` of a register equals its ``curr``,
    so ``r.next = r.curr`` may be left out, and so may the copy of a register whose ``next`` was not written.
    The statements at the edge read registers as they were (``curr``) and combinational values that are
    complete before the first of them, so their order is free. The reset is an input that the driver never
    sets, so the answer to it is no. A text, or a statement, in which this cannot be seen stays as it is.

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
    blocks = _edge_blocks(text[first:end])
    if blocks is None:
        return text
    aliases = dict(re.findall(rf"^\t({_NAME}) = ({_NAME});$", text[start:first], re.MULTILINE))

    def root(name: str) -> str:
        while name in aliases:
            name = aliases[name]
        return name

    writes: dict[str, int] = {}
    for name in re.findall(rf"({_NAME})\.next\b", text[start:end]):
        writes[name] = writes.get(name, 0) + 1
    tree, others = _Block(), []
    for block in blocks:
        match = re.fullmatch(rf"\t\t({_NAME})\.next = (.*);", block) if "\n" not in block else None
        line = f"\t\tif ({match[1]}.commit(observer)) changed = true;\n" if match else ""
        if match and writes[match[1]] == 1 and text.count(line) == 1:
            tree.add(match[1], match[2], root)
        else:
            others.append(f"{_CLOCK}\n{block}\n\t}}\n")
    writer = _Writer()
    writer.write(tree, "\t\t", None)
    edge = "\n".join([_CLOCK, *writer.lines, "\t}\n"]) + "".join(others)
    text = text[:first] + edge + text[end:]

    copies = ""
    for flag, registers in enumerate(writer.groups()):
        lines = [f"\t\tif ({register}.commit(observer)) changed = true;\n" for register in registers]
        for line in lines:
            text = text.replace(line, "", 1)
        body = "".join(f"\t{line}" for line in lines)
        copies += f"\t\tif (changed_{flag}) {{\n\t\t\tchanged_{flag} = false;\n{body}\t\t}}\n"
    flags = "".join(f"\tbool changed_{flag} = false;\n" for flag in range(len(writer.above)))
    text = text.replace("\t\treturn changed;\n", f"{copies}\t\treturn changed;\n", 1)
    return text.replace("\tbool eval(performer *performer", f"{flags}\n\tbool eval(performer *performer", 1)


def _edge_blocks(text: str) -> list[str] | None:
    """Bodies of the statements at the clock's edge; ``None`` if there is anything else among them."""
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
