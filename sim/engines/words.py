"""CXXRTL's C++ with expressions of at most 64 bits rewritten to expressions of one machine word.

CXXRTL writes every expression with templates over the widths: ``add_uu<5>(a.curr, b.slice<7,4>().val())``.
A compiler takes longer to instantiate and inline them than for all the rest. `plain_words` writes such an
expression as ``((a.curr.data[0] + ((b.data[0] >> 4) & 0xf)) & 0x1f)``. The model behaves the same, and
compiles in two fifths of the time.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

__all__ = ["plain_words"]

_TOKEN = re.compile(r"0x[0-9a-f]+u|\d+u?|\w+|\S")
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
_NUMBER = re.compile(r"0x[0-9a-f]+ull")
_HEADER = "#include <cxxrtl/cxxrtl.h>\n"

_ARITHMETIC = {"add": "+", "sub": "-", "mul": "*", "and": "&", "or": "|", "xor": "^"}
_ORDER = {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_EQUALITY = {"eq": "==", "ne": "!=", "eqx": "==", "nex": "!="}
_SHIFTS = {
    "shl_uu": "shifted_left",
    "shl_su": "shifted_left",
    "sshl_uu": "shifted_left",
    "sshl_su": "shifted_left",
    "shr_uu": "shifted_right",
    "sshr_uu": "shifted_right",
    "shift_uu": "shifted_right",
    "shiftx_uu": "shifted_right",
    "sshr_su": "shifted_signed",
}


LONG = 4096
"""Length of a long expression's text, in characters. In a longer assignment the operands get names. A longer
condition or memory access stays as it is.
"""


class _Left(Exception):
    """Raised for a statement that is not understood, and so stays as it is."""


class _Expression(NamedTuple):
    """C++ of an expression, and what is known of its value.

    ``code`` is a variable's name if ``variable``; else a word, below 2^width, for up to 64 bits, and a
    ``value`` for more. The other fields are empty where they do not apply:

    - ``low``: simpler C++ of a word with the lowest 64 bits.
    - ``among``: a word and a mask. The expression is not 0 if, and only if, the word is a constant whose bit
      is set in the mask.
    - ``bits``: a variable, and the last and first of some of its bits. The expression equals these bits; or,
      if it has 1 bit and they are more, it tells whether they are not all 0.
    - ``zeros``: a variable, last and first bit, and a number. The expression is the count of leading zeros of
      these bits plus the number.
    """

    code: str
    width: int
    variable: bool = False
    low: str = ""
    among: tuple[str, int] | None = None
    bits: "tuple[_Expression, int, int] | None" = None
    zeros: "tuple[_Expression, int, int, int] | None" = None

    @property
    def word(self) -> str:
        if self.width > 64:
            raise _Left
        if not self.width:
            return "0x0ull"
        return f"{self.code}.data[0]" if self.variable else self.code

    @property
    def signed(self) -> str:
        spare = 64 - self.width
        return f"word(int64_t({self.word} << {spare}) >> {spare})" if 0 < spare < 64 else self.word

    @property
    def value(self) -> str:
        if self.variable or self.width > 64:
            return self.code
        return f"value<{self.width}>::cut({self.word})" if self.width else "value<0>{}"


def _of_value(code: str, width: int) -> _Expression:
    return _Expression(code if width > 64 else f"{code}.data[0]", width)


def _mask(width: int) -> str:
    return f"{(1 << width) - 1:#x}ull"


def _cut(code: str, width: int) -> str:
    return f"({code})" if width == 64 else f"(({code}) & {_mask(width)})"


def _literal(parts: str) -> int:
    chunks = [int(part.rstrip("u"), 0) for part in re.findall(r"\w+", parts)]
    return sum(chunk << 32 * n for n, chunk in enumerate(chunks))


class _Parser:
    """Recursive-descent parser of one expression.

    In a text of more than `LONG` characters, operands whose code has more than 64 characters get a name, and
    equal ones the same: ``names``, by code. CXXRTL repeats the text of an operand at every use; in a divider
    the text of a step is repeated for every step after it.
    """

    def __init__(self, text: str, variables: dict[str, tuple[str, int]]):
        self.tokens = _TOKEN.findall(text)
        self.at = 0
        self.variables = variables
        self.named = len(text) > LONG
        self.names: dict[str, str] = {}

    def next(self) -> str:
        if self.at == len(self.tokens):
            raise _Left
        self.at += 1
        return self.tokens[self.at - 1]

    def take(self, *tokens: str) -> None:
        for token in tokens:
            if self.next() != token:
                raise _Left

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def number(self) -> int:
        token = self.next()
        if not token.isdigit():
            raise _Left
        return int(token)

    def numbers(self) -> list[int]:
        """Numbers in a list of template arguments."""
        self.take("<")
        found = [self.number()]
        while self.peek() == ",":
            self.take(",")
            found.append(self.number())
        self.take(">")
        return found

    def expressions(self, end: str = "") -> list[_Expression]:
        """Expressions with commas between them, up to a token or the end of the text."""
        found = [self.expression()]
        while self.peek() == ",":
            self.take(",")
            found.append(self.expression())
        if self.peek() != end:
            raise _Left
        if end:
            self.take(end)
        return found

    def expression(self) -> _Expression:
        token = self.next()
        if token == "(":
            result = self.choice()
        elif token == "value":
            result = self.constant()
        elif token in self.variables:
            kind, width = self.variables[token]
            if kind == "wire":
                self.take(".")
                if (part := self.next()) not in ("curr", "next"):
                    raise _Left
                token = f"{token}.{part}"
            result = _Expression(token, width, True)
        else:
            (width,) = self.numbers()
            self.take("(")
            arguments = self.expressions(")")
            result = (_unary if len(arguments) == 1 else _binary)(token, width, *arguments)
        while self.peek() == ".":
            self.take(".")
            result = self.method(result)
        if self.named and len(result.code) > 64 and not result.variable and 0 < result.width <= 64:
            result = result._replace(code=self.names.setdefault(result.code, f"n_{len(self.names)}"))
        return result

    def choice(self) -> _Expression:
        question = self.expression()
        self.take("?")
        yes = self.expression()
        self.take(":")
        no = self.expression()
        self.take(")")
        if yes.width != no.width:
            raise _Left
        parts = (yes.word, no.word) if yes.width <= 64 else (yes.value, no.value)
        if zeros := _zeros(question, yes, no):
            return _Expression(_leading_zeros(*zeros[:3]), yes.width, zeros=zeros)
        return _Expression(f"({question.word} ? {parts[0]} : {parts[1]})", yes.width)

    def constant(self) -> _Expression:
        (width,) = self.numbers()
        start = self.at
        opening = self.next()
        while self.next() != {"(": ")", "{": "}"}.get(opening):
            pass
        parts = self.tokens[start + 1 : self.at - 1]
        if width > 64:
            return _Expression(f"value<{width}>{{{''.join(parts)}}}", width)
        return _Expression(f"{_literal(' '.join(parts)):#x}ull", width)

    def method(self, of: _Expression) -> _Expression:
        method = self.next()
        if method == "val":
            self.take("(", ")")
            return of
        if method == "slice":
            last, *first = self.numbers()
            self.take("(", ")")
            return _slice(of, last, *first or [last])
        if method == "concat":
            self.take("(")
            (low,) = self.expressions(")")
            width = of.width + low.width
            if width > 64:
                return _Expression(f"{of.value}.concat({low.value}).val()", width)
            same = of.among and low.among and of.among[0] == low.among[0]
            among = (of.among[0], of.among[1] | low.among[1]) if same else None
            code = f"({of.word} << {low.width} | {low.word})"
            return _Expression(code, width, among=among, zeros=low.zeros if of.word == "0x0ull" else None)
        if method == "repeat" and of.width == 1:
            (width,) = self.numbers()
            self.take("(", ")")
            if width > 64:
                return _Expression(f"{of.value}.repeat<{width}>()", width)
            return _Expression(_cut(f"-{of.word}", width), width)
        raise _Left


def _slice(of: _Expression, last: int, first: int) -> _Expression:
    width = last - first + 1
    if last >= of.width or width <= 0:
        raise _Left
    if of.low and last < 64:
        return _Expression(_cut(f"{of.low} >> {first}", width), width)
    if width > 64 or not (of.variable or of.width <= 64):
        return _of_value(f"{of.value}.slice<{last},{first}>().val()", width)
    if not of.variable:
        bits = _bits(of)
        bits = bits and (bits[0], bits[2] + last, bits[2] + first)
        return _Expression(_cut(f"{of.word} >> {first}", width), width, bits=bits)
    bits = (of, last, first)
    start, shift = divmod(first, 64)
    code = f"{of.code}.data[{start}]"
    if shift:
        code = f"{code} >> {shift}"
    if last // 64 != start:
        code = f"{code} | {of.code}.data[{start + 1}] << {64 - shift}"
    elif last == of.width - 1:
        return _Expression(f"({code})", width, bits=bits)
    return _Expression(_cut(code, width), width, bits=bits)


def _bits(of: _Expression) -> tuple[_Expression, int, int] | None:
    """Variable, last and first bit that an expression equals; ``None`` if unknown."""
    if of.variable:
        return of, of.width - 1, 0
    return of.bits if of.bits and of.width == of.bits[1] - of.bits[2] + 1 else None


def _zeros(
    question: _Expression, yes: _Expression, no: _Expression
) -> tuple[_Expression, int, int, int] | None:
    """``zeros`` of ``(question ? yes : no)``, if it counts the leading zeros of adjacent bits; else ``None``.

    The condition is that the upper part of the bits is not 0; then ``yes`` counts its leading zeros, else
    ``no`` those of the lower part and adds the width of the upper one.
    """
    if not (yes.zeros and no.zeros and question.bits):
        return None
    of, last, middle = question.bits
    of_no, below, first, more = no.zeros
    halves = yes.zeros == (of, last, middle, 0) and (of_no, below, more) == (
        of,
        middle - 1,
        last - middle + 1,
    )
    return (of, last, first, 0) if halves and (last - first + 1) >> yes.width == 0 else None


def _leading_zeros(of: _Expression, last: int, first: int) -> str:
    return f"leading_zeros({_slice(of, last, first).word}, {last - first + 1})"


def _unary(name: str, width: int, a: _Expression) -> _Expression:
    code, among, bits, zeros = None, None, None, None
    if name == "logic_not" and width <= 64:
        code = f"word({a.word} == 0)" if a.width <= 64 else f"word(!bool({a.value}))"
        among = (a.word, 1) if a.width <= 6 else None
    elif name in ("reduce_or", "reduce_bool") and a.among and a.width > 1 and width == 1:
        # A look-up in the mask, instead of a comparison with each constant.
        code = f"(({a.among[1]:#x}ull >> {a.among[0]}) & 0x1ull)"
    elif name in ("reduce_or", "reduce_bool") and width <= 64:
        code = f"word({a.word} != 0)" if a.width <= 64 else f"word(bool({a.value}))"
        bits = _bits(a) if width == 1 else None
    elif name == "reduce_and" and max(width, a.width) <= 64:
        code = f"word({a.word} == {_mask(a.width)})"
    elif name == "not_u" and a.width == width > 64:
        code = f"{a.value}.bit_not()"
    elif name in ("not_u", "not_s", "pos_u", "pos_s", "neg_u", "neg_s") and max(width, a.width) <= 64:
        operand = a.word if name.endswith("_u") else a.signed
        code = _cut({"not": "~", "pos": "", "neg": "-"}[name[:3]] + operand, width)
        if name == "not_u" and a.width == width == 1 and _bits(a):
            zeros = (*_bits(a), 0)
    if code is None:
        return _of_value(f"{name}<{width}>({a.value})", width)
    return _Expression(code, width, among=among, bits=bits, zeros=zeros)


def _binary(name: str, width: int, a: _Expression, b: _Expression) -> _Expression:
    code = None
    operation, _, signs = name.rpartition("_")
    if max(width, a.width, b.width) <= 64:
        left, right = (a.signed, b.signed) if signs == "ss" else (a.word, b.word)
        if name in ("logic_and", "logic_or"):
            code = f"word({a.word} {'&&' if name == 'logic_and' else '||'} {b.word})"
        elif name in _SHIFTS:
            code = _cut(f"{_SHIFTS[name]}({a.signed if signs == 'su' else a.word}, {b.word})", width)
        elif signs in ("uu", "ss") and operation in _ARITHMETIC:
            code = f"{left} {_ARITHMETIC[operation]} {right}"
            # A bitwise operation on operands no wider than the result needs no mask.
            fits = signs == "uu" and operation in ("and", "or", "xor") and max(a.width, b.width) <= width
            code = f"({code})" if fits else _cut(code, width)
            if operation == "add" and b.zeros and _NUMBER.fullmatch(left):
                of, last, first, more = b.zeros
                more += int(left.rstrip("ul"), 0)
                if (more + last - first + 1) >> width == 0:
                    return _Expression(code, width, zeros=(of, last, first, more))
        elif signs in ("uu", "ss") and operation in _EQUALITY:
            code = f"word({left} {_EQUALITY[operation]} {right})"
            if signs == "uu" and _EQUALITY[operation] == "==" and a.width <= 6 and _NUMBER.fullmatch(right):
                constant = int(right.rstrip("ul"), 0)
                return _Expression(code, width, among=(left, 1 << constant if constant < 64 else 0))
        elif signs in ("uu", "ss") and operation in _ORDER:
            if signs == "ss":
                left, right = f"int64_t({left})", f"int64_t({right})"
            code = f"word({left} {_ORDER[operation]} {right})"
    elif width <= 64 and a.width == b.width and operation in _EQUALITY:
        code = f"word({a.value} {_EQUALITY[operation]} {b.value})"
    elif operation in ("shl", "sshl") and max(a.width, b.width) <= 64:
        low = f"{_SHIFTS[name]}({a.signed if signs == 'su' else a.word}, {b.word})"
        return _Expression(f"{name}<{width}>({a.value}, {b.value})", width, low=low)
    if code is None:
        return _of_value(f"{name}<{width}>({a.value}, {b.value})", width)
    return _Expression(code, width)


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
            raise _Left
        (question,) = _Parser(match[4][1:-1] if match[3] else match[4], variables).expressions()
        code = question.word if question.width <= 64 else f"bool({question.value})"
        return f"{match[1]}{match[2]}({code}){match[5]}"
    if match := _INDEX.match(line) or _UPDATE.match(line):
        if len(match[2]) > LONG:
            raise _Left
        values = ", ".join(value.value for value in _Parser(match[2], variables).expressions())
        return f"{match[1]}{values}{match[3]}"
    match = _ASSIGNMENT.match(line)
    if not match:
        raise _Left
    indent, target, last, first, text = match.groups()
    name, _, following = target.partition(".")
    kind, width = variables.get(name, ("", 0))
    if (kind == "wire") != bool(following):
        raise _Left
    stop = width - 1 if last is None else int(last)
    start = 0 if last is None else int(first or last)
    parser = _Parser(text, variables)
    (value,) = parser.expressions()
    if value.width != stop - start + 1 or stop >= width:
        raise _Left
    if value.width <= 64:
        stored = _store(target, width, stop, start, value.word)
    else:
        place = "" if last is None else f".slice<{stop},{start}>()"
        stored = f"{target}{place} = {value.value};"
    if not parser.names:
        return indent + stored
    names = "".join(f"const word {name} = {code}; " for code, name in parser.names.items())
    return f"{indent}{{ {names}{stored} }}"


def _table(match: re.Match) -> str:
    """C++ that copies a memory's initial words from an array of machine words in a loop."""
    width, name, depth, memory, start = int(match[1]), match[2], match[3], match[5], match[6]
    words = -(-width // 64)
    entries = []
    for literal in re.findall(r"\{(.*?)\}", match[4]):
        value = _literal(literal)
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
        raise _Left
    # `reset` is called by the constructor alone, when everything is 0.
    indent, name, width, value = match[1], match[2], int(match[3]), _literal(match[4])
    if not value:
        return ""
    if width > 64 or "wire" not in line:
        raise _Left
    return f"{indent}{name}.curr.data[0] = {name}.next.data[0] = {value:#x}ull;"


def plain_words(text: str) -> str:
    """Rewrite the C++ of `write_cxxrtl`, statement by statement. An unknown statement stays as it is.

    The driver's ``value`` and ``wire`` keep their bits in ``data``, words of 64 bits with 0 above the width.
    The text includes CXXRTL's header only if it still needs CXXRTL's operations, on wide operands.

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
        except _Left:
            return line

    lines = [rewritten(line, _reset) for line in _TABLE.sub(_table, text[reset:evaluate]).split("\n")]
    lines += [rewritten(line, _statement, variables) for line in text[evaluate:].split("\n")]
    text = _COMMIT.sub(r"\1\2.curr = \2.next;", text[:reset]) + "\n".join(lines)
    return text if _LIBRARY.search(text) else text.replace(_HEADER, "")
