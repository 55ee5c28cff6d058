"""Bit-accurate model of the lobe unit: any curve of 1 - N·H by one small table and one multiplier."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.lobes import curve_lines
from blysk.golden.reference.reflection import BLINN, ReflectionModel

__all__ = ["Lobe", "LobeTable"]


@dataclass(frozen=True)
class Lobe(HighlightOperand):
    """Any lobe of ``u = 1 - N·H`` from a table, linear between entries that are denser where u is small.

    *Address.* The range [0, 1) of u is divided into E octaves, ``[2^-j, 2^(1-j))`` with j = 1 to E, and the
    rest, ``[0, 2^-E)``. These are the E + 1 *rows* of the table: row 0 is the rest, row E the octave from
    1/2. A row has M equal steps. So the distance of two entries is between 1/(2M) and 1/M of u in every
    octave, and ``2^-E / M`` in row 0. u's leading one gives the row, and the next m = log2(M) bits give the
    step. The bits after them give f, the position of u within the step, 0 to 1.

    *Entries.* There are (E + 1) M entries, and an entry for the end, u = 1. A word of the memory holds an
    entry v and its difference D to the next entry, of either sign: 35 bits. A block RAM of 512 by 36 holds
    512 words. The term is ``v + D f``, with one product.

    ============= =========== =====================================================================
    word          format      why
    ============= =========== =====================================================================
    u             UQ(1, B)    B is 25, or more for narrower lobes; 0 where negative
    f             UQ(0, F)    ``F = min(17, B - 1 - m)``; multiplier operand; cut
    v             UQ(0, 17)   rounded; an entry of 1 is ``1 - 2^-17``
    D             SQ(1, 17)   exact difference of two v; multiplier operand
    D f           SQ(1, 17)   cut
    result        UQ(0, 17)   v + D f is between v and the next entry: it cannot wrap
    ============= =========== =====================================================================

    *Range.* The term is 0 where N·H is not positive, ``u >= 1``, and for a dark beat. Vectors longer than 1
    may give a negative u, which counts as 0.

    *Monotone.* Over the whole range the term falls where the entries fall. `table` makes falling entries from
    every falling curve.

    *Arithmetic error*, against straight lines between entries that are not rounded: at most `ERROR`, 0.006
    LSB of an 8-bit channel at intensity 1.

    *Error of the lines.* docs/theory/bounds.md#lobe-tables derives it. Measured in LSB, with rounding:

    == == ===== ======================== ======================== =======================================
    E  M  words ``blinn``, n =           ``beckmann``, alpha =    ``ggx``, alpha =
                1, 2, 10, 100, 1000      0.03, 0.1, 0.3, 0.6, 1   0.0025, 0.01, 0.03, 0.05, 0.1, 0.3, 0.6
    == == ===== ======================== ======================== =======================================
    14 32 480   0.00 0.01 0.01 0.01 0.01 0.01 0.01 0.01 0.02 0.14 15 0.13 0.01 0.01 0.01 0.01 0.01
    15 16 256   0.00 0.05 0.03 0.03 0.03 0.03 0.03 0.04 0.06 0.55 15 0.13 0.02 0.02 0.02 0.02 0.02
    20 16 336   0.00 0.05 0.03 0.03 0.03 0.03 0.03 0.04 0.06 0.55 0.03 0.02 0.02 0.02 0.02 0.02 0.02
    == == ===== ======================== ======================== =======================================

    Without the error of u, the largest error found of the default table is 0.05 LSB. This holds at exponents
    from 1 to 1000 and for ``ggx`` from alpha = 0.0025 (roughness 0.05) on. Beckmann's distribution with a
    large alpha falls to 0 just before u = 1, where steps are long: 0.55 LSB at alpha = 1.

    *Error of u.* The slope of the lobe multiplies it: n for Blinn's power, ``4/alpha^2`` for ``ggx``. A step
    of 2^-25 is 0.008 LSB for n = 1000. For ``ggx`` it is 0.3 LSB at alpha = 0.01 and 4.9 LSB at 0.0025: such
    lobes need B = 30 or `scale` 6. With the operand ``cosine`` a length error of 2^-18 of the normal is 1 LSB
    for n = 1000. The chord form (operand ``one_minus_cosine``) depends on this length at second order only.

    *Gate.* A highlight gate leaves out only terms that are 0. So the picture is the same to the bit with and
    without a gate. The largest argument with a term over 0 follows from the table
    (`LobeTable.last_lit_argument`). A lobe with a long tail may have terms over 0 up to u = 1: ``ggx`` from
    alpha = 0.044 on. Its gate leaves out only spans that face away from H. With a ``cutoff`` a gate leaves
    out more: `table` sets entries under the cutoff to 0. The picture then differs from the picture of the
    model, in the same way with and without a gate. The difference is at most the cutoff times the intensity
    I, with ``cutoff = 1/(510 I)`` half an LSB. A gate must keep terms over 0, even under half an LSB, because
    they may change the rounding of a sum.

    *Loading.* A write of 18 bits loads an entry. Entries come in order, and the unit computes the differences
    (`LobeTable.writes`). A table takes (E + 1) M + 2 writes, 338 by default. Words of 35 bits would take
    twice as many writes. Several *banks* hold a table each for several materials, so a change of the material
    takes no write. The word at address ``(bank (E + 1) + row) M + step`` belongs to a bank.

    Parameters
    ----------
    reflection : ReflectionModel
        Model of N·H for which `table` makes tables. The hardware does not depend on it.
    operand : str
        ``"cosine"`` or ``"one_minus_cosine"``; see `HighlightOperand`.
    octaves : int
        E, at least 1; ``E + log2 M`` is at most B.
    steps : int
        M, a power of two, 2 to 256.
    banks : int
        Number of tables, 1 to `MAX_BANKS`.
    fraction_bits : int
        B, 20 to 34.
    cutoff : float
        Entries of a table under this value are 0; at least 0, under 1.
    scale : int
        s. The operand of ``chord-local`` is ``min(2^s u, 1)``, for lobes that are 0 from ``u = 2^-s`` on.
    fixed : tuple of float or None
        Parameters of the tables that are fixed at build time, one for each bank (``None`` for a model without
        a parameter). ``None`` in place of the tuple: writes load the tables.

    Raises
    ------
    ValueError
        If a parameter is out of range, there are not as many fixed tables as banks, or the model is of R·V.

    Source: docs/theory/units.md#lobe; [PICA200] has tables of a cosine in equal steps, with differences.
    """

    reflection: ReflectionModel = BLINN
    operand: Literal["cosine", "one_minus_cosine"] = "cosine"
    octaves: int = 20
    steps: int = 16
    banks: int = 1
    fraction_bits: int = 25
    cutoff: float = 0.0
    scale: int = 0
    fixed: tuple[float | None, ...] | None = None

    SERVES_MIRROR: ClassVar[bool] = False
    VALUE_FORMAT: ClassVar[Format] = UQ(0, 17)
    DIFFERENCE_FORMAT: ClassVar[Format] = SQ(1, 17)
    WORD_BITS: ClassVar[int] = VALUE_FORMAT.width + DIFFERENCE_FORMAT.width
    MAX_BANKS: ClassVar[int] = 64
    MOST_SCALE: ClassVar[int] = 6
    SHARP: ClassVar[float] = 2.0**14
    FINER: ClassVar[tuple[int, int]] = (14, 32)
    ERROR: ClassVar[float] = 3 * 2.0**-17

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reflection.MIRROR and not self.SERVES_MIRROR:
            raise ValueError(
                f"a table holds a lobe of N·H, but {self.reflection.name} has R·V; take phong_coplanar"
            )
        if self.steps not in (2**bits for bits in range(1, 9)):
            raise ValueError(f"steps must be a power of two from 2 to 256, not {self.steps}")
        if not 20 <= self.fraction_bits <= 34:
            raise ValueError(f"fraction_bits must be 20 to 34, not {self.fraction_bits}")
        if not 1 <= self.octaves <= self.fraction_bits - self.step_bits:
            raise ValueError(
                f"octaves must be 1 to {self.fraction_bits - self.step_bits} with {self.steps} steps and "
                f"{self.fraction_bits} fraction bits, not {self.octaves}"
            )
        if not 1 <= self.banks <= self.MAX_BANKS:
            raise ValueError(f"banks must be 1 to {self.MAX_BANKS}, not {self.banks}")
        if not 0 <= self.cutoff < 1:
            raise ValueError(f"cutoff must be at least 0 and under 1, not {self.cutoff}")
        if self.scale < 0 or (self.scale and self.operand == "cosine"):
            raise ValueError(
                f"scale must be 0, or over 0 with the operand one_minus_cosine, not {self.scale}"
            )
        if self.fixed is not None:
            object.__setattr__(self, "fixed", tuple(self.fixed))
            if len(self.fixed) != self.banks:
                raise ValueError(f"{len(self.fixed)} tables are fixed, of {self.banks} banks")
            for parameter in self.fixed:
                self.reflection.reflect(1.0, parameter)

    @property
    def has_table(self) -> bool:
        """``True``: the unit computes by tables."""
        return True

    @property
    def table_options(self) -> dict[str, Any]:
        """Options of the tables by name: ``banks``, ``cutoff`` and ``fixed``."""
        return {"banks": self.banks, "cutoff": self.cutoff, "fixed": self.fixed}

    def for_operand(self, operand: Any, scale: int = 0) -> "Lobe":
        """The unit for another operand or scale; see `HighlightOperand.for_operand`."""
        same = (self.operand, self.scale) == (operand, scale)
        return self if same else replace(self, operand=operand, scale=scale)

    @property
    def fixed_tables(self) -> "list[LobeTable] | None":
        """Tables that are fixed at build time."""
        return None if self.fixed is None else [self.table(parameter) for parameter in self.fixed]

    @property
    def name(self) -> str:
        """Name of the reflection model."""
        return self.reflection.name

    @property
    def argument_format(self) -> Format:
        """Format of u."""
        return UQ(1, self.fraction_bits)

    @property
    def operand_format(self) -> Format:
        """Format of the input."""
        return super().operand_format if self.operand == "cosine" else self.argument_format

    @property
    def step_bits(self) -> int:
        """Bits of the step's address, log2 M."""
        return self.steps.bit_length() - 1

    @property
    def fraction_format(self) -> Format:
        """Format of f."""
        return UQ(0, min(17, self.fraction_bits - 1 - self.step_bits))

    @property
    def rows(self) -> int:
        """Rows of a table, E + 1."""
        return self.octaves + 1

    @property
    def entries(self) -> int:
        """Words of a table, ``(E + 1) M``."""
        return self.rows * self.steps

    @cached_property
    def knots(self) -> np.ndarray:
        """Arguments u of the entries and of the end, 1: float64 array, shape (entries + 1,)."""
        row, step = np.divmod(np.arange(self.entries + 1), self.steps)
        # A row from 1 on begins at 2^(row-1-E); row 0 goes on with the steps of row 1.
        start = np.where(row > 0, self.steps, 0)
        found: np.ndarray = np.ldexp((start + step) / self.steps, np.maximum(row, 1) - 1 - self.octaves)
        return found

    @property
    def cosines(self) -> tuple[np.ndarray, np.ndarray]:
        """Cosines at entries and end, and in the middles of steps. The end is just before the right angle."""
        knots = np.ldexp(np.minimum(self.knots, 1 - 2.0**-40), -self.scale)
        return 1 - knots, 1 - (knots[1:] + knots[:-1]) / 2

    def _beside(self, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the lines on the left and the right of each entry."""
        return np.r_[high[0], high], np.r_[high, high[-1]]

    def table(self, parameter: float | None = None) -> "LobeTable":
        """Table of the model for one parameter.

        Two lines meet at an entry. An entry is the value of the curve, moved to lessen the error of these
        lines. This error is measured in the middle of each line. The entry is moved by half of the larger
        error, but by at most twice the smaller error. If one line is too high and the other too low, the
        entry stays.

        Parameters
        ----------
        parameter : float, optional
            Exponent or roughness, as `ReflectionModel.PARAMETER` says.

        Raises
        ------
        ValueError
            If the parameter of the model is missing or out of range.
        """
        if parameter is None and self.reflection.PARAMETER is not None:
            raise ValueError(f"a table of {self.name} needs its {self.reflection.PARAMETER}")
        value, middle = (self.reflection.reflect(cosine, parameter) for cosine in self.cosines)
        high = (value[1:] + value[:-1]) / 2 - middle
        left, right = self._beside(high)
        larger, smaller = np.maximum(np.abs(left), np.abs(right)), np.minimum(np.abs(left), np.abs(right))
        move = np.where(left * right > 0, np.sign(left) * np.minimum(larger / 2, 2 * smaller), 0)
        format = self.VALUE_FORMAT
        codes = Fixed.round(format, np.clip(value - move, 0, 1 - format.step)).codes
        falls, rises = (np.diff(value) <= 0).all(), (np.diff(value) >= 0).all()
        if falls or rises:
            codes = (np.minimum if falls else np.maximum).accumulate(codes)
        values = Fixed(format, np.where(codes < self.cutoff / format.step, 0, codes))
        return LobeTable(self, values, parameter)

    def scale_of(self, parameters: Sequence[float | None]) -> int:
        """Largest scale, up to `MOST_SCALE`, that serves all lobes. It is 0 if no lobe needs a scale.

        A lobe needs a scale if its slope is over `SHARP`. A step of 2^-25 of u is then over 0.1 LSB. Scale s
        serves a lobe that is under a quarter of the least entry from ``u = 2^-s`` on.

        Parameters
        ----------
        parameters : sequence of float or None
            Parameters of the model.
        """
        lines = [curve_lines(self.reflection, parameter) for parameter in dict.fromkeys(parameters)]
        if all(slope.max() <= self.SHARP for _, _, slope in lines):
            return 0
        dark = max(u[np.flatnonzero(value > self.VALUE_FORMAT.step / 4)[-1]] for u, value, _ in lines)
        return int(np.floor(-np.log2(np.clip(dark, 2.0**-self.MOST_SCALE, 1))))

    def for_parameters(self, parameters: Sequence[float | None]) -> "Lobe":
        """The unit with `FINER` steps in place of the default steps, if the error of a table is over 1/4 LSB.

        This happens for lobes with a steep end near a right angle, such as Beckmann's with roughness 1. With
        one bank either size takes one block RAM. If a sharp lobe needs the default octaves, they stay.

        Parameters
        ----------
        parameters : sequence of float or None
            Parameters of the model.
        """
        if (self.octaves, self.steps) != (Lobe.octaves, Lobe.steps):
            return self
        finer = replace(self, octaves=self.FINER[0], steps=self.FINER[1])
        errors = [max(of.line_error(one) for one in dict.fromkeys(parameters)) for of in (self, finer)]
        return finer if errors[0] > 1 / 1020 and errors[1] < errors[0] else self

    def line_error(self, parameter: float | None) -> float:
        """Largest error of the lines between a table's entries, without arithmetic error."""
        values, knots = self.table(parameter).values.values, self.knots
        share = np.arange(1, 8) / 8
        u = (knots[:-1] + np.diff(knots) * share[:, np.newaxis]).ravel()
        exact = self.reflection.reflect(1 - np.ldexp(u, -self.scale), parameter)
        return float(np.abs(np.interp(u, knots, values) - exact).max())

    @property
    def last_lit_arguments(self) -> np.ndarray:
        """`LobeTable.last_lit_argument` of the model's table at each exponent; exponent 0 counts as 1.

        Raises
        ------
        ValueError
            If the model has no exponent. Its gate gets the threshold of a table.
        """
        if self.reflection.PARAMETER != "exponent":
            raise ValueError(f"{self.name} has no exponent, by which a gate could look up its threshold")
        exponents = range(1 << self.EXPONENT_BITS)
        return np.array([self.table(max(exponent, 1)).last_lit_argument for exponent in exponents])

    def argument(self, operand: Fixed) -> Fixed:
        """Argument u of an operand.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if operand.format != self.operand_format:
            raise ValueError(f"operand must be {self.operand_format}, not {operand.format}")
        exact = ONE_SQUARED - operand if self.operand == "cosine" else operand
        return exact.truncate(self.argument_format.fraction_bits).saturate(self.argument_format)

    def address(self, argument: Fixed) -> tuple[np.ndarray, Fixed]:
        """Word of a table, and position within its step, for arguments under 1.

        Parameters
        ----------
        argument : Fixed, any shape, UQ(1, B)
            u, under 1.

        Returns
        -------
        entry : int64 array, same shape
            Index of the word in its table.
        fraction : Fixed, same shape, UQ(0, F)
            f.
        """
        code, top = argument.codes, self.fraction_bits - 1
        # float64 holds a code under 2^34 exactly. frexp counts the place of its leading 1 from 1, and gives 0
        # for 0.
        _, length = np.frexp(code.astype(np.float64))
        row = np.maximum(length - self.fraction_bits + self.octaves, 0)
        normal = code << (self.octaves - np.maximum(row, 1))
        below = normal & ((1 << top) - 1)
        width = top - self.step_bits
        fraction = (below & ((1 << width) - 1)) >> (width - self.fraction_format.width)
        return row * self.steps + (below >> width), Fixed(self.fraction_format, fraction)

    def compute(self, operand: Fixed, dark: np.ndarray, table: "LobeTable") -> Fixed:
        """Bit-accurate specular terms, see `HighlightOperand.compute`; a cosine is in units of `ONE_SQUARED`.

        Raises
        ------
        ValueError
            If the operand has another format, ``table`` is no table, or has another size or scale.
        """
        self.check(table)
        u = self.argument(operand)
        front = operand.codes > 0 if self.operand == "cosine" else u.codes < 1 << u.format.width - 1
        lit = front & ~np.asarray(dark, dtype=bool)
        entry, fraction = self.address(Fixed(u.format, np.where(lit, u.codes, 0)))
        way = (table.differences[entry] * fraction).truncate(17)
        term = (table.values[entry] + way).codes
        return Fixed(self.RESULT_FORMAT, np.where(lit, term, 0))

    def check(self, table: "LobeTable") -> None:
        """Refuse an object that is not a table, and a table of another size or scale.

        Raises
        ------
        ValueError
            If ``table`` is refused.
        """
        if not isinstance(table, LobeTable):
            raise ValueError("a lobe needs a table; constants_of gives a scene's constants their tables")
        given, own = ((lobe.octaves, lobe.steps) for lobe in (table.lobe, self))
        if given != own or table.lobe.entries != self.entries:
            raise ValueError("the table has {} octaves of {} steps, the unit {} of {}".format(*given, *own))
        if table.lobe.scale != self.scale:
            raise ValueError(f"the table is of 2^{table.lobe.scale} u, the unit of 2^{self.scale} u")


@dataclass(frozen=True, eq=False)
class LobeTable:
    """Entries of a `Lobe`'s table, for one model and parameter, made by `Lobe.table`.

    Parameters
    ----------
    lobe : Lobe
        Unit with the size and model of the table.
    values : Fixed, shape (entries + 1,), UQ(0, 17)
        Entries, and the value at the end.
    parameter : float, optional
        Exponent or roughness of the lobe.

    Raises
    ------
    ValueError
        If the number of entries or their format is wrong.

    Source: docs/theory/units.md#lobe.
    """

    lobe: Lobe
    values: Fixed
    parameter: float | None = None

    def __post_init__(self) -> None:
        format, shape = Lobe.VALUE_FORMAT, (self.lobe.entries + 1,)
        if (self.values.format, self.values.shape) != (format, shape):
            raise ValueError(
                f"a table has {shape[0]} values of {format}, not {self.values.shape} of {self.values.format}"
            )

    @property
    def differences(self) -> Fixed:
        """D: Fixed, shape (entries,), SQ(1, 17)."""
        return Fixed(Lobe.DIFFERENCE_FORMAT, np.diff(self.values.codes))

    @property
    def words(self) -> np.ndarray:
        """Words of the memory, v in the low 17 bits and D in the 18 above: int64 array, shape (entries,)."""
        difference, value = Lobe.DIFFERENCE_FORMAT, Lobe.VALUE_FORMAT
        low = self.differences.codes & ((1 << difference.width) - 1)
        found: np.ndarray = self.values.codes[:-1] | low << value.width
        return found

    def writes(self, bank: int = 0) -> dict[str, np.ndarray]:
        """Beats that load the table: the bank with ``begins`` set, then every value in order.

        Parameters
        ----------
        bank : int
            Bank to load.

        Returns
        -------
        dict
            ``value``, 17 bits, and ``begins``, 1 bit: int64 arrays, shape (entries + 2,). In a word of 18
            bits ``begins`` is the highest.

        Raises
        ------
        ValueError
            If there is no such bank.
        """
        if not 0 <= bank < self.lobe.banks:
            raise ValueError(f"bank must be 0 to {self.lobe.banks - 1}, not {bank}")
        value = np.r_[bank, self.values.codes]
        return {"value": value, "begins": (np.arange(len(value)) == 0).astype(np.int64)}

    @property
    def last_lit_argument(self) -> int:
        """Largest u, in steps of 2^-25, whose term is over 0; -1 if there is none. Exact, in integers.

        An argument with more fraction bits is cut to 25.
        """
        lobe, values = self.lobe, self.values.codes
        lit = np.flatnonzero((values[:-1] > 0) | (values[1:] > 0))
        if not len(lit):
            return -1
        entry, fraction = int(lit[-1]), lobe.fraction_format
        start, end = (round(knot * 2**lobe.fraction_bits) for knot in lobe.knots[entry : entry + 2].tolist())
        argument, last = end - 1, int(values[entry])
        if not values[entry + 1]:
            # last + floor(-last f) >= 1, where f is the share of the step, cut.
            f = ((last - 1) << fraction.width) // last
            argument = start + (((f + 1) * (end - start) - 1) >> fraction.width)
        shift = 25 - lobe.fraction_bits
        return int(((argument + 1) << shift) - 1 if shift > 0 else argument >> -shift)
