"""UART receiver: from the levels of a serial line to bytes."""

from dataclasses import dataclass

import numpy as np

__all__ = ["FRACTION_BITS", "UartReceiver"]

FRACTION_BITS = 4
"""Fraction bits of the number of cycles of a bit."""

_BITS = 10


@dataclass(frozen=True)
class UartReceiver:
    """Finds bytes on a line: a start bit of 0, eight data bits with the lowest first, a stop bit of 1.

    With the cycle of the first 0 as cycle 0, bit k is taken in cycle ``floor((D / 2 + k D) / 16)``, in its
    middle. D is the divisor. If the line is 1 in the middle of the start bit, no byte begins. If the line is
    0 in the middle of the stop bit, the byte is dropped and counted as a framing error. The receiver then
    waits until the line is 1.

    The stop bit is taken after nine bits and a half. So bits of a sender may be longer or shorter by up to
    5 %, less one cycle in nine bits.

    Parameters
    ----------
    divisor : int
        Cycles of a bit, in 1/16. The least value is 32, two cycles.

    Raises
    ------
    ValueError
        If the divisor is less than 32.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    divisor: int

    def __post_init__(self) -> None:
        if self.divisor < 2 << FRACTION_BITS:
            raise ValueError(f"a bit must have 2 cycles or more, not {self.divisor / 16:g}")

    @classmethod
    def of(cls, clock: float, baud: float) -> "UartReceiver":
        """Receiver for a rate of the clock in Hz, and a number of bits a second."""
        return cls(round(clock / baud * (1 << FRACTION_BITS)))

    def compute(self, levels: np.ndarray) -> tuple[np.ndarray, int]:
        """Bytes of a line, and the number of framing errors.

        Parameters
        ----------
        levels : array, shape (C,)
            Level of the line in each cycle, 0 or 1.
        """
        middles = (self.divisor // 2 + self.divisor * np.arange(_BITS)) >> FRACTION_BITS
        zeros, ones = (np.flatnonzero(np.asarray(levels) == level) for level in (0, 1))
        found: list[int] = []
        errors = cycle = 0
        while True:
            start = _next(zeros, cycle)
            if start is None or start + middles[0] >= len(levels):
                break
            if levels[start + middles[0]]:
                cycle = start + int(middles[0]) + 1
                continue
            if start + middles[-1] >= len(levels):
                break
            bits = np.asarray(levels)[start + middles[1:]]
            cycle = start + int(middles[-1]) + 1
            if bits[-1]:
                found.append(int(bits[:-1] @ (1 << np.arange(_BITS - 2))))
                continue
            errors += 1
            after = _next(ones, cycle)
            if after is None:
                break
            cycle = after + 1
        return np.array(found, dtype=np.int64), errors

    def line(self, data: bytes, idle: int = 0) -> np.ndarray:
        """Levels of a line that sends bytes without a pause.

        Parameters
        ----------
        data : bytes
            The bytes.
        idle : int
            Cycles without a byte before the first byte, and after the last byte.
        """
        bits = np.ones((len(data), _BITS), dtype=np.uint8)
        bits[:, 0] = 0
        codes = np.frombuffer(data, dtype=np.uint8)[:, np.newaxis]
        bits[:, 1:-1] = codes >> np.arange(_BITS - 2, dtype=np.uint8) & 1
        ends = (np.arange(bits.size + 1) * self.divisor) >> FRACTION_BITS
        rest = np.ones(idle, dtype=np.uint8)
        return np.concatenate([rest, np.repeat(bits.ravel(), np.diff(ends)), rest])


def _next(places: np.ndarray, least: int) -> int | None:
    """The first of sorted places that is not before another place."""
    index = np.searchsorted(places, least)
    return int(places[index]) if index < len(places) else None
