"""Display timing: which pixel a display shows on each cycle of the pixel clock, and its sync pulses."""

from dataclasses import dataclass, field

import numpy as np

__all__ = ["VGA", "Axis", "DisplayMode", "DisplayTiming"]


@dataclass(frozen=True)
class Axis:
    """Lengths along a line in pixels, or down a frame in lines: picture, front porch, sync, back porch.

    Parameters
    ----------
    visible, front, sync, back : int
        Each at least 1, in this order.
    positive : bool
        Whether the sync signal is high during its pulse.

    Raises
    ------
    ValueError
        If a length is below 1.
    """

    visible: int
    front: int
    sync: int
    back: int
    positive: bool = False

    def __post_init__(self):
        if min(self.visible, self.front, self.sync, self.back) < 1:
            raise ValueError("every part of a line or of a frame has at least one pixel or line")

    @property
    def total(self) -> int:
        """All four parts."""
        return self.visible + self.front + self.sync + self.back

    @property
    def pulse(self) -> tuple[int, int]:
        """First position of the sync pulse, and the first after it."""
        return self.visible + self.front, self.visible + self.front + self.sync


@dataclass(frozen=True)
class DisplayMode:
    """A mode of a display: 640x480 at 60 Hz unless told otherwise, 800x525 with its porches.

    Parameters
    ----------
    horizontal, vertical : Axis
        A line, and a frame of lines.
    refresh : float
        Frames a second.

    Source: docs/theory/video.md#display.
    """

    horizontal: Axis = field(default_factory=lambda: Axis(640, 16, 96, 48))
    vertical: Axis = field(default_factory=lambda: Axis(480, 10, 2, 33))
    refresh: float = 60.0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.horizontal.visible, self.vertical.visible

    @property
    def cycles(self) -> int:
        """Cycles of the pixel clock in a frame."""
        return self.horizontal.total * self.vertical.total

    @property
    def pixel_rate(self) -> float:
        """Pixel clock, Hz: 25.2 MHz for the default."""
        return self.cycles * self.refresh


VGA = DisplayMode()
"""640x480 at 60 Hz."""


@dataclass(frozen=True)
class DisplayTiming:
    """Position, whether it is in the picture, and both sync signals, a cycle of the pixel clock each.

    Cycle 0 is the first pixel below the picture, so that the blank lines come before the first frame. The
    position counts through the porches: x below the line's total, y below the frame's. The vertical signal
    changes where the horizontal pulse begins, so that its porches count from the last pixel's end. Exact.

    Parameters
    ----------
    mode : DisplayMode
        Lengths and polarities.

    Source: docs/theory/video.md#display.
    """

    mode: DisplayMode = VGA

    def compute(self, count: int, first: int = 0) -> dict[str, np.ndarray]:
        """Outputs on cycles ``first`` to ``first + count - 1``, by name: x, y, active, hsync, vsync.

        Parameters
        ----------
        count : int
            Cycles.
        first : int
            The first of them.
        """
        line, frame = self.mode.horizontal, self.mode.vertical
        position = (np.arange(first, first + count) + frame.visible * line.total) % self.mode.cycles
        y, x = np.divmod(position, line.total)
        return {
            "x": x,
            "y": y,
            "active": (x < line.visible) & (y < frame.visible),
            "hsync": self._sync(x, line),
            "vsync": self._sync(y + (x >= line.pulse[0]), frame),
        }

    @staticmethod
    def _sync(position: np.ndarray, axis: Axis) -> np.ndarray:
        begin, end = axis.pulse
        return ((position >= begin) & (position < end)) == axis.positive
