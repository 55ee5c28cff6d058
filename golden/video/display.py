"""Display: frames to the words of four lanes, and back to frames with a check of every rule of the lanes."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from blysk.golden.video.display_timing import VGA, DisplayMode, DisplayTiming
from blysk.golden.video.tmds_encoder import (
    BITS,
    CLOCK_WORD,
    CONTROL_WORDS,
    MAX_DISPARITY,
    TmdsEncoder,
    bits_of,
)

__all__ = ["Display", "LaneError"]


class LaneError(ValueError):
    """Raised for lanes that break a rule of the display mode. The message is one line."""


@dataclass(frozen=True)
class Display:
    """Words of four lanes for frames in a mode: blue with both sync signals, green, red, and the clock.

    `compute` makes the words of frames. `decode` finds words in bits as a display does, by the control words.
    It checks four rules:

    - words are control words exactly where the mode is blank;
    - both sync signals pulse at the right pixels;
    - lanes are aligned with the lane of the clock;
    - no disparity exceeds `MAX_DISPARITY`.

    Parameters
    ----------
    mode : DisplayMode
        Mode of the display.

    Source: docs/theory/video.md#tmds.
    """

    mode: DisplayMode = VGA

    def compute(self, frames: np.ndarray) -> np.ndarray:
        """Words of frames from power-up on, which begins with the first blank line before the first frame.

        Parameters
        ----------
        frames : int array, shape (n, height, width, 3)
            Channels of 8 bits.

        Returns
        -------
        int64 array, shape (n cycles, 4)
        """
        cycles = DisplayTiming(self.mode).compute(len(frames) * self.mode.cycles)
        active = cycles["active"]
        data = np.zeros((len(active), 3), dtype=np.int64)
        data[active] = np.asarray(frames).reshape(-1, 3)[:, ::-1]
        controls = (cycles["hsync"] + 2 * cycles["vsync"], 0 * cycles["x"], 0 * cycles["x"])
        encode = TmdsEncoder().compute
        lanes = [encode(data[:, k], control, active) for k, control in enumerate(controls)]
        return np.stack([*lanes, np.full(len(active), CLOCK_WORD)], axis=-1)

    def decode(self, bits: np.ndarray) -> np.ndarray:
        """All whole frames in the bits of lanes, shape (n, height, width, 3).

        Parameters
        ----------
        bits : int array, shape (n, 4)
            Bits of the lanes in the order of sending, from any bit on.

        Raises
        ------
        LaneError
            At the first broken rule.
        """
        words = self.words(bits)
        is_control = np.isin(words[:, :3], CONTROL_WORDS)
        if (is_control != is_control[:, :1]).any():
            raise LaneError(f"word {np.argmax((is_control != is_control[:, :1]).any(1))}: lanes not together")
        active = ~is_control[:, 0]
        control = np.searchsorted(np.sort(CONTROL_WORDS), words[:, 0])
        control = np.argsort(CONTROL_WORDS)[np.minimum(control, 3)]
        # A frame begins with the first pixel after at least one blank line.
        blank = np.diff(np.r_[-1, np.flatnonzero(active)])
        line = self.mode.horizontal
        tops = np.flatnonzero(active)[blank > line.total]
        visible = self.mode.vertical.visible * line.total
        tops = tops[tops + visible - line.total + line.visible <= len(words)]
        if len(tops) == 0:
            raise LaneError("no frame begins in these words, or it does not end")
        first = self.mode.vertical.total - self.mode.vertical.visible
        expected = DisplayTiming(self.mode).compute(visible, first * line.total)
        frames = np.empty((len(tops), *self.mode.size[::-1], 3), dtype=np.uint8)
        for k, top in enumerate(tops.tolist()):
            # The porches of the last line may still be missing.
            sent = min(visible, len(words) - top)
            part = slice(top, top + sent)
            wrong = active[part] != expected["active"][:sent]
            if wrong.any():
                at = np.argmax(wrong)
                raise LaneError(f"frame {k}: line {at // line.total} is blank or not at {at % line.total}")
            frames[k] = TmdsEncoder().decode(words[part, :3][active[part]])[:, ::-1].reshape(frames[k].shape)
        self._check_sync(control, active, tops)
        self._check_balance(words, is_control)
        return frames

    def words(self, bits: np.ndarray) -> np.ndarray:
        """Words in the bits of lanes, shape (n // 10, 4), aligned by control words.

        Raises
        ------
        LaneError
            If no alignment gives runs of control words, or the lane of the clock has another word.
        """
        weights = 1 << np.arange(BITS)
        counts = []
        for offset in range(BITS):
            whole = bits[offset : offset + (len(bits) - offset) // BITS * BITS].reshape(
                -1, BITS, bits.shape[1]
            )
            words = np.einsum("nbl,b->nl", whole, weights)
            is_control = np.logical_and.reduce(np.isin(words[:, :3], CONTROL_WORDS), axis=1)
            # Two control words in a row cannot be a part of colours, at any cut into words.
            counts.append((int((is_control[1:] & is_control[:-1]).sum()), offset, words))
        count, _, words = max(counts, key=lambda count: count[0])
        if count == 0:
            raise LaneError("no control words: the lanes are not aligned with each other")
        # The lanes are idle until the crossing has started.
        started = int(np.argmax(words[:, 3] == CLOCK_WORD))
        words = words[started:]
        if (words[:, 3] != CLOCK_WORD).any():
            raise LaneError(f"word {np.argmax(words[:, 3] != CLOCK_WORD)}: the clock's lane breaks off")
        found: np.ndarray = words
        return found

    def _check_sync(self, control: np.ndarray, active: np.ndarray, tops: np.ndarray) -> None:
        """Check both sync signals where lines are blank, from the first frame's top to the last frame's."""
        for top, following in pairwise(tops):
            if following - top != self.mode.cycles:
                raise LaneError(f"a frame lasts {following - top} pixels, not {self.mode.cycles}")
        end = tops[-1] + (self.mode.vertical.visible - 1) * self.mode.horizontal.total
        first = (self.mode.vertical.total - self.mode.vertical.visible) * self.mode.horizontal.total
        expected = DisplayTiming(self.mode).compute(int(end - tops[0]), first)
        blank = ~active[tops[0] : end]
        code = expected["hsync"] + 2 * expected["vsync"]
        wrong = (control[tops[0] : end] != code) & blank
        if wrong.any():
            raise LaneError(f"a sync signal is wrong {np.argmax(wrong)} pixels after the first")

    @staticmethod
    def _check_balance(words: np.ndarray, is_control: np.ndarray) -> None:
        """Check the disparity, ones minus zeros since the last control word, after every word of colour."""
        lean = 2 * bits_of(words[:, :3]).sum(-1) - BITS
        total = np.cumsum(np.where(is_control, 0, lean), axis=0)
        start = np.maximum.accumulate(np.where(is_control, np.arange(len(words))[:, np.newaxis], 0), axis=0)
        total = total - np.take_along_axis(total, start, axis=0)
        # Before the first control word the start of the sum is unknown.
        seen = np.maximum.accumulate(is_control, axis=0)
        if (np.abs(total)[seen] > MAX_DISPARITY).any():
            raise LaneError("a lane is not balanced: it sends too many ones, or too many zeros")
