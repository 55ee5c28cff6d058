"""CXXRTL's expressions, read and written anew. Values of up to 64 bits are computed in one machine word.

CXXRTL writes every expression with templates over the widths: ``add_uu<5>(a.curr, b.slice<7,4>().val())``.
`expressions_of` reads such an expression. It writes
``((a.curr.data[0] + ((b.data[0] >> 4) & 0xf)) & 0x1f)``.
"""

import re
from typing import NamedTuple

__all__ = ["LONG", "Expression", "Unreadable", "expressions_of", "literal"]

_TOKEN = re.compile(r"0x[0-9a-f]+u|\d+u?|\w+|\S")
_NUMBER = re.compile(r"0x[0-9a-f]+ull")

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


class Unreadable(Exception):
    """Raised for a statement that is not understood. The statement then stays as it is."""


class Expression(NamedTuple):
    """C++ of an expression, and what is known of its value.

    If ``variable``, ``code`` is a variable's name. Else ``code`` gives a word below 2^width, or a CXXRTL
    ``value`` for more than 64 bits. The other fields are empty if they do not apply:

    - ``low``: simpler C++ of a word with the lowest 64 bits.
    - ``among``: a word and a mask. The expression is not 0 if, and only if, bit k of the mask is set, where k
      is the value of the word.
    - ``bits``: a variable, and the last and first of some of its bits. The expression equals these bits. If
      the expression has only 1 bit, and these bits are several, the expression equals the OR of these bits.
    - ``zeros``: a variable, last and first bit, and a number. The expression is the count of leading zeros of
      these bits plus the number.
    """

    code: str
    width: int
    variable: bool = False
    low: str = ""
    among: tuple[str, int] | None = None
    bits: "tuple[Expression, int, int] | None" = None
    zeros: "tuple[Expression, int, int, int] | None" = None

    @property
    def word(self) -> str:
        """The value as a word. More than 64 bits are refused as `Unreadable`."""
        if self.width > 64:
            raise Unreadable
        if not self.width:
            return "0x0ull"
        return f"{self.code}.data[0]" if self.variable else self.code

    @property
    def signed(self) -> str:
        """The word with its sign bit repeated up to bit 63."""
        spare = 64 - self.width
        return f"word(int64_t({self.word} << {spare}) >> {spare})" if 0 < spare < 64 else self.word

    @property
    def value(self) -> str:
        """The value as a CXXRTL ``value`` of any width."""
        if self.variable or self.width > 64:
            return self.code
        return f"value<{self.width}>::cut({self.word})" if self.width else "value<0>{}"


def _of_value(code: str, width: int) -> Expression:
    return Expression(code if width > 64 else f"{code}.data[0]", width)


def _mask(width: int) -> str:
    return f"{(1 << width) - 1:#x}ull"


def _cut(code: str, width: int) -> str:
    return f"({code})" if width == 64 else f"(({code}) & {_mask(width)})"


def literal(parts: str) -> int:
    """Number of a constant that CXXRTL writes in parts of 32 bits, the lowest first."""
    chunks = [int(part.rstrip("u"), 0) for part in re.findall(r"\w+", parts)]
    return sum(chunk << 32 * n for n, chunk in enumerate(chunks))


class _Parser:
    """Recursive-descent parser of one expression.

    In a text of more than `LONG` characters, operands whose code has more than 64 characters get a name.
    Equal operands get the same name; ``names`` has the names by code. CXXRTL repeats the text of an operand
    at every use. In a divider it repeats the text of a step for every later step.
    """

    def __init__(self, text: str, variables: dict[str, tuple[str, int]]):
        self.tokens = _TOKEN.findall(text)
        self.at = 0
        self.variables = variables
        self.named = len(text) > LONG
        self.names: dict[str, str] = {}

    def next(self) -> str:
        if self.at == len(self.tokens):
            raise Unreadable
        self.at += 1
        return self.tokens[self.at - 1]

    def take(self, *tokens: str) -> None:
        for token in tokens:
            if self.next() != token:
                raise Unreadable

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def number(self) -> int:
        token = self.next()
        if not token.isdigit():
            raise Unreadable
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

    def expressions(self, end: str = "") -> list[Expression]:
        """Expressions with commas between them, up to a token or the end of the text."""
        found = [self.expression()]
        while self.peek() == ",":
            self.take(",")
            found.append(self.expression())
        if self.peek() != end:
            raise Unreadable
        if end:
            self.take(end)
        return found

    def expression(self) -> Expression:
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
                    raise Unreadable
                token = f"{token}.{part}"
            result = Expression(token, width, True)
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

    def choice(self) -> Expression:
        question = self.expression()
        self.take("?")
        yes = self.expression()
        self.take(":")
        no = self.expression()
        self.take(")")
        if yes.width != no.width:
            raise Unreadable
        parts = (yes.word, no.word) if yes.width <= 64 else (yes.value, no.value)
        if zeros := _zeros(question, yes, no):
            return Expression(_leading_zeros(*zeros[:3]), yes.width, zeros=zeros)
        return Expression(f"({question.word} ? {parts[0]} : {parts[1]})", yes.width)

    def constant(self) -> Expression:
        (width,) = self.numbers()
        start = self.at
        opening = self.next()
        while self.next() != {"(": ")", "{": "}"}.get(opening):
            pass
        parts = self.tokens[start + 1 : self.at - 1]
        if width > 64:
            return Expression(f"value<{width}>{{{''.join(parts)}}}", width)
        return Expression(f"{literal(' '.join(parts)):#x}ull", width)

    def method(self, of: Expression) -> Expression:
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
                return Expression(f"{of.value}.concat({low.value}).val()", width)
            same = of.among and low.among and of.among[0] == low.among[0]
            among = (of.among[0], of.among[1] | low.among[1]) if same else None
            code = f"({of.word} << {low.width} | {low.word})"
            return Expression(code, width, among=among, zeros=low.zeros if of.word == "0x0ull" else None)
        if method == "repeat" and of.width == 1:
            (width,) = self.numbers()
            self.take("(", ")")
            if width > 64:
                return Expression(f"{of.value}.repeat<{width}>()", width)
            return Expression(_cut(f"-{of.word}", width), width)
        raise Unreadable


def _slice(of: Expression, last: int, first: int) -> Expression:
    width = last - first + 1
    if last >= of.width or width <= 0:
        raise Unreadable
    if of.low and last < 64:
        return Expression(_cut(f"{of.low} >> {first}", width), width)
    if width > 64 or not (of.variable or of.width <= 64):
        return _of_value(f"{of.value}.slice<{last},{first}>().val()", width)
    if not of.variable:
        bits = _bits(of)
        bits = bits and (bits[0], bits[2] + last, bits[2] + first)
        return Expression(_cut(f"{of.word} >> {first}", width), width, bits=bits)
    bits = (of, last, first)
    start, shift = divmod(first, 64)
    code = f"{of.code}.data[{start}]"
    if shift:
        code = f"{code} >> {shift}"
    if last // 64 != start:
        code = f"{code} | {of.code}.data[{start + 1}] << {64 - shift}"
    elif last == of.width - 1:
        return Expression(f"({code})", width, bits=bits)
    return Expression(_cut(code, width), width, bits=bits)


def _bits(of: Expression) -> tuple[Expression, int, int] | None:
    """Variable, last and first bit that an expression equals; ``None`` if unknown."""
    if of.variable:
        return of, of.width - 1, 0
    return of.bits if of.bits and of.width == of.bits[1] - of.bits[2] + 1 else None


def _zeros(question: Expression, yes: Expression, no: Expression) -> tuple[Expression, int, int, int] | None:
    """``zeros`` of ``(question ? yes : no)``, if it counts the leading zeros of adjacent bits; else ``None``.

    The condition is that the upper part of the bits is not 0. Then ``yes`` counts the upper part's leading
    zeros. Else ``no`` counts the lower part's leading zeros, and adds the width of the upper part.
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


def _leading_zeros(of: Expression, last: int, first: int) -> str:
    return f"leading_zeros({_slice(of, last, first).word}, {last - first + 1})"


def _unary(name: str, width: int, a: Expression) -> Expression:
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
    return Expression(code, width, among=among, bits=bits, zeros=zeros)


def _binary(name: str, width: int, a: Expression, b: Expression) -> Expression:
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
            # A bitwise operation needs no mask if no operand is wider than the result.
            fits = signs == "uu" and operation in ("and", "or", "xor") and max(a.width, b.width) <= width
            code = f"({code})" if fits else _cut(code, width)
            if operation == "add" and b.zeros and _NUMBER.fullmatch(left):
                of, last, first, more = b.zeros
                more += int(left.rstrip("ul"), 0)
                if (more + last - first + 1) >> width == 0:
                    return Expression(code, width, zeros=(of, last, first, more))
        elif signs in ("uu", "ss") and operation in _EQUALITY:
            code = f"word({left} {_EQUALITY[operation]} {right})"
            if signs == "uu" and _EQUALITY[operation] == "==" and a.width <= 6 and _NUMBER.fullmatch(right):
                constant = int(right.rstrip("ul"), 0)
                return Expression(code, width, among=(left, 1 << constant if constant < 64 else 0))
        elif signs in ("uu", "ss") and operation in _ORDER:
            if signs == "ss":
                left, right = f"int64_t({left})", f"int64_t({right})"
            code = f"word({left} {_ORDER[operation]} {right})"
    elif width <= 64 and a.width == b.width and operation in _EQUALITY:
        code = f"word({a.value} {_EQUALITY[operation]} {b.value})"
    elif operation in ("shl", "sshl") and max(a.width, b.width) <= 64:
        low = f"{_SHIFTS[name]}({a.signed if signs == 'su' else a.word}, {b.word})"
        return Expression(f"{name}<{width}>({a.value}, {b.value})", width, low=low)
    if code is None:
        return _of_value(f"{name}<{width}>({a.value}, {b.value})", width)
    return Expression(code, width)


def expressions_of(
    text: str, variables: dict[str, tuple[str, int]]
) -> tuple[list[Expression], dict[str, str]]:
    """Read expressions with commas between them.

    Parameters
    ----------
    text : str
        C++ of the expressions.
    variables : dict
        Kind (``value`` or ``wire``) and width of each variable, by its name.

    Returns
    -------
    expressions : list of Expression
        The expressions.
    names : dict of str
        Names for operands that a text of more than `LONG` characters repeats, by their C++.

    Raises
    ------
    Unreadable
        If the text is no expression, or has an unknown variable or operation.
    """
    parser = _Parser(text, variables)
    return parser.expressions(), parser.names
