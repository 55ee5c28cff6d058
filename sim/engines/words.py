"""CXXRTL's C++ with expressions of at most 64 bits rewritten to expressions of one machine word.

CXXRTL writes every expression with templates over the widths: ``add_uu<5>(a.curr, b.slice<7,4>().val())``.
A compiler takes longer to instantiate and inline these templates than for all the rest. `plain_words` writes
this expression as ``((a.curr.data[0] + ((b.data[0] >> 4) & 0xf)) & 0x1f)``. The model behaves the same, and
compiles in two fifths of the time.
"""

import re
from collections.abc import Callable

from blysk.sim.engines.expressions import LONG, Unreadable, expressions_of, literal

__all__ = ["plain_words"]

_DECLARED = re.compile(r"^\t+(?:/\*\w+\*/ )?(value|wire)<(\d+)> (\w+)(?=;| \{| =)", re.MULTILINE)
_ASSIGNMENT = re.compile(r"^(\t+)([pi]_\w+(?:\.(?:next|curr))?)(?:\.slice<(\d+)(?:,(\d+))?>\(\))? = (.*);$")
_CONDITION = re.compile(r"^(\t+if \()(!?)(bool)?(\(.*\)|\w+<.*)(\) \{)$")
_INDEX = re.compile(r"^(\t+auto \w+ = memory_index\()(.*)(, \d+, \d+\);)$")
_UPDATE = re.compile(r"^(\t+\w+\.(?:update|write)\(\w+\.index, )(.*?)((?:, \d+)?\);)$")
_COMMIT = re.compile(r"^(\t+)if \(([pi]_\w+)\.commit\(observer\)\) changed = true;$", re.MULTILINE)
_RESET = re.compile(r"^(\t)([pi]_\w+) = (?:wire|value)<(\d+)>\{(.*)\};$")
_TABLE = re.compile(
    r"^\tstatic const value<(\d+)> (mem_init_\d+)\[(\d+)\] \{\n(.*?)\};\n"
    r"\tstd::copy\(std::begin\(\2\), std::end\(\2\), &(\w+)\.data\[(\d+)\]\);$",
    re.MULTILINE | re.DOTALL,
)
_LIBRARY = re.compile(r"\b(?:[a-z]+_(?:u|s|uu|ss|su|us)|reduce_\w+|logic_\w+)<\d+>\(|std::copy")
_HEADER = "#include <cxxrtl/cxxrtl.h>\n"


def _store(target: str, width: int, last: int, first: int, code: str) -> str:
    """C++ that stores a word in bits ``first`` to ``last`` of a variable of ``width`` bits."""
    if (first, last) == (0, width - 1) and width <= 64:
        return f"{target}.data[0] = {code};"
    word, shift = divmod(first, 64)
    mask = (1 << (last - first + 1)) - 1
    low = mask << shift & (1 << 64) - 1
    kept = f"{target}.data[{word}] & {~low & (1 << 64) - 1:#x}ull"
    if last // 64 == word:
        return f"{target}.data[{word}] = ({kept}) | {code} << {shift};"
    high = mask >> (64 - shift)
    kept_high = f"{target}.data[{word + 1}] & {~high & (1 << 64) - 1:#x}ull"
    return (
        f"{{ const word part = {code}; {target}.data[{word}] = ({kept}) | part << {shift}; "
        f"{target}.data[{word + 1}] = ({kept_high}) | part >> {64 - shift}; }}"
    )


def _statement(line: str, variables: dict[str, tuple[str, int]]) -> str:
    if match := _CONDITION.match(line):
        if len(match[4]) > LONG:
            raise Unreadable
        (question,), _ = expressions_of(match[4][1:-1] if match[3] else match[4], variables)
        code = question.word if question.width <= 64 else f"bool({question.value})"
        return f"{match[1]}{match[2]}({code}){match[5]}"
    if match := _INDEX.match(line) or _UPDATE.match(line):
        if len(match[2]) > LONG:
            raise Unreadable
        values = ", ".join(value.value for value in expressions_of(match[2], variables)[0])
        return f"{match[1]}{values}{match[3]}"
    match = _ASSIGNMENT.match(line)
    if not match:
        raise Unreadable
    indent, target, last, first, text = match.groups()
    name, _, following = target.partition(".")
    kind, width = variables.get(name, ("", 0))
    if (kind == "wire") != bool(following):
        raise Unreadable
    stop = width - 1 if last is None else int(last)
    start = 0 if last is None else int(first or last)
    (value,), named = expressions_of(text, variables)
    if value.width != stop - start + 1 or stop >= width:
        raise Unreadable
    if value.width <= 64:
        stored = _store(target, width, stop, start, value.word)
    else:
        place = "" if last is None else f".slice<{stop},{start}>()"
        stored = f"{target}{place} = {value.value};"
    if not named:
        return indent + stored
    names = "".join(f"const word {name} = {code}; " for code, name in named.items())
    return f"{indent}{{ {names}{stored} }}"


def _table(match: re.Match) -> str:
    """C++ that copies a memory's initial words from an array of machine words in a loop."""
    width, name, depth, memory, start = int(match[1]), match[2], match[3], match[5], match[6]
    words = -(-width // 64)
    entries = []
    for entry in re.findall(r"\{(.*?)\}", match[4]):
        value = literal(entry)
        entries += [f"{value >> 64 * n & (1 << 64) - 1:#x}ull" for n in range(words)]
    lines = "".join(f"\t\t{', '.join(entries[n : n + 8])},\n" for n in range(0, len(entries), 8))
    return (
        f"\tstatic const word {name}[{depth} * {words}] {{\n{lines}\t}};\n"
        f"\tfor (size_t k = 0; k < {depth} * {words}; k++)\n"
        f"\t\t{memory}.data[{start} + k / {words}].data[k % {words}] = {name}[k];"
    )


def _reset(line: str) -> str:
    match = _RESET.match(line)
    if not match:
        raise Unreadable
    # `reset` is called by the constructor alone, when everything is 0.
    indent, name, width, value = match[1], match[2], int(match[3]), literal(match[4])
    if not value:
        return ""
    if width > 64 or "wire" not in line:
        raise Unreadable
    return f"{indent}{name}.curr.data[0] = {name}.next.data[0] = {value:#x}ull;"


def plain_words(text: str) -> str:
    """Rewrite the C++ of `write_cxxrtl`, statement by statement. An unknown statement stays as it is.

    In `cxxrtl_driver.cc`, ``value`` and ``wire`` keep their bits in ``data``: words of 64 bits, with 0 above
    the width. The result includes CXXRTL's header only if it still has CXXRTL's operations on wide operands.

    Parameters
    ----------
    text : str
        C++ of one module, without debug information, whose ``reset`` only the constructor calls.

    Returns
    -------
    str
        C++ with the same class.
    """
    reset, evaluate = text.find("void p_top::reset("), text.find("bool p_top::eval(")
    if reset < 0 or evaluate < reset:
        return text
    variables: dict[str, tuple[str, int]] = {}
    twice = set()
    for kind, width, name in _DECLARED.findall(text):
        if variables.setdefault(name, (kind, int(width))) != (kind, int(width)):
            twice.add(name)
    for name in twice:
        del variables[name]

    def rewritten(line: str, rewrite: Callable[..., str], *arguments: object) -> str:
        try:
            return rewrite(line, *arguments)
        except Unreadable:
            return line

    lines = [rewritten(line, _reset) for line in _TABLE.sub(_table, text[reset:evaluate]).split("\n")]
    lines += [rewritten(line, _statement, variables) for line in text[evaluate:].split("\n")]
    text = _COMMIT.sub(r"\1\2.curr = \2.next;", text[:reset]) + "\n".join(lines)
    return text if _LIBRARY.search(text) else text.replace(_HEADER, "")
