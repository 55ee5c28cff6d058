"""TMDS encoder and decoder: a byte of colour as ten bits with few transitions and no direct current."""

from dataclasses import dataclass

import numpy as np

__all__ = ["BITS", "CLOCK_WORD", "CONTROL_WORDS", "MAX_DISPARITY", "TmdsEncoder", "bits_of"]

BITS = 10
"""Bits of a word; bit 0 is sent first."""

CONTROL_WORDS = (0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011)
"""Words outside the picture, by ``c0 + 2 c1`` of the control bits c0 and c1.

They have seven transitions or more. Words of colour have fewer.
"""

CLOCK_WORD = 0b1111100000
"""Word that the clock's lane repeats. A word begins with its falling edge."""

MAX_DISPARITY = 8
"""Largest running disparity after a word: ones minus zeros sent since the last control word."""


def bits_of(words: np.ndarray, count: int = BITS) -> np.ndarray:
    """Bits of words, bit 0 first; shape (..., count)."""
    return np.asarray(words)[..., np.newaxis] >> np.arange(count) & 1


@dataclass(frozen=True)
class TmdsEncoder:
    """Ten bits for each byte, after figure 3-5 of DVI 1.0: a step for few transitions, a step for balance.

    Bit 0 of the *chain* is bit 0 of the byte. Each further bit is the bit of the byte XOR or XNOR the chain's
    bit before. XNOR is taken if the byte has more than four ones, or four ones and bit 0 is 0. Bit 8 is 1 for
    XOR, 0 for XNOR. Then the eight bits are sent as they are, or inverted with bit 9 set. The choice brings
    the running disparity nearer to 0. In a control period one of `CONTROL_WORDS` is sent, and the disparity
    becomes 0.

    Every word decodes to its byte. The running disparity stays even and within `MAX_DISPARITY` for all data.

    Source: docs/theory/video.md#tmds.
    """

    latency = 3

    def chain(self, byte: np.ndarray) -> np.ndarray:
        """The nine bits before the balance: bits 0 to 7 of the chain, and bit 8, which is 1 for XOR.

        Bytes have any shape.
        """
        bits = bits_of(byte, 8)
        ones = bits.sum(-1)
        use_xnor = (ones > 4) | ((ones == 4) & (bits[..., 0] == 0))
        # XNOR inverts at every step: after k of them a parity is inverted k times.
        parity = np.bitwise_xor.accumulate(bits, axis=-1) ^ (use_xnor[..., np.newaxis] & np.arange(8) & 1)
        found: np.ndarray = (parity << np.arange(8)).sum(-1) | (~use_xnor).astype(np.int64) << 8
        return found

    def step(self, chain: np.ndarray, disparity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Word of a chain, and the disparity after it; both broadcast.

        Parameters
        ----------
        chain : int64 array
            Result of `chain`.
        disparity : int64 array
            Running disparity before the word; even.
        """
        xor = chain >> 8 & 1
        excess = 2 * bits_of(chain & 255, 8).sum(-1) - 8
        even = (disparity == 0) | (excess == 0)
        invert = np.where(even, 1 - xor, (disparity > 0) == (excess > 0))
        word = np.where(invert, ~chain & 255, chain & 255) | xor << 8 | invert << 9
        # Ones minus zeros of the word: of its eight bits, and of bits 8 and 9.
        return word, disparity + np.where(invert, -excess, excess) + 2 * (xor + invert) - 2

    def compute(self, data: np.ndarray, control: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Bit-accurate words of a stream, from a disparity of 0 on.

        Parameters
        ----------
        data : int64 array, shape (n,)
            Bytes; sent where ``active``.
        control : int64 array, shape (n,)
            ``c0 + 2 c1``; sent elsewhere.
        active : bool array, shape (n,)
            Whether the pixel is in the picture.

        Returns
        -------
        int64 array, shape (n,)
        """
        active = np.asarray(active, dtype=bool)
        states = np.arange(-MAX_DISPARITY, MAX_DISPARITY + 2, 2)
        middle = len(states) // 2
        word, after = self.step(self.chain(np.arange(256))[:, np.newaxis], states)
        # Each beat maps the disparity before it to the disparity after it. Doubling composes the maps of all
        # beats up to each beat. A disparity over the bound does not occur, so its entry has no effect.
        table = np.clip(after // 2 + middle, 0, len(states) - 1).astype(np.int8)
        reach = np.where(active[:, np.newaxis], table[data], np.int8(middle))
        shift = 1
        while shift < len(reach):
            reach[shift:] = np.take_along_axis(reach[shift:], reach[:-shift].astype(np.intp), axis=1)
            shift *= 2
        before = np.r_[middle, reach[:-1, middle]][: len(active)]
        return np.where(active, word[data, before], np.take(CONTROL_WORDS, control))

    def decode(self, words: np.ndarray) -> np.ndarray:
        """Bytes of words outside control periods, any shape."""
        bits = bits_of(words)
        chain = bits[..., :8] ^ bits[..., 9:]
        byte = chain.copy()
        byte[..., 1:] ^= chain[..., :-1] ^ 1 - bits[..., 8:9]
        found: np.ndarray = (byte << np.arange(8)).sum(-1)
        return found
