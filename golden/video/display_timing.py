"""Display timing: pixel and sync signals of a display on each cycle of the pixel clock."""

from dataclasses import dataclass, field

import numpy as np

__all__ = ["VGA", "Axis", "DisplayMode", "DisplayTiming"]


@dataclass(frozen=True)
class Axis:
    """Lengths along a line in pixels, or down a frame in lines: picture, front porch, sync, back porch.

    Parameters
    ----------
    visible, front, sync, back : int
        Lengths of the parts in this order, each at least 1.
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

    def __post_init__(self) -> None:
        if min(self.visible, self.front, self.sync, self.back) < 1:
            raise ValueError("every part of a line or of a frame has at least one pixel or line")

    @property
    def total(self) -> int:
        """Length of all four parts together."""
        return self.visible + self.front + self.sync + self.back

    @property
    def pulse(self) -> tuple[int, int]:
        """First position of the sync pulse, and first position after it."""
        return self.visible + self.front, self.visible + self.front + self.sync


@dataclass(frozen=True)
class DisplayMode:
    """A mode of a display. The default is 640x480 at 60 Hz, 800x525 with its porches.

    Parameters
    ----------
    horizontal, vertical : Axis
        Parts of a line, and of a frame.
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
    """For each cycle of the pixel clock: position, whether it is in the picture, and both sync signals.

    Cycle 0 is the first pixel below the picture. So the blank lines come before the first frame. The position
    includes the porches: x is below the line's total, y below the frame's total. The vertical sync signal
    changes at the start of the horizontal pulse. So its porches count from the last pixel's end.

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
            First cycle.
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
        found: np.ndarray = ((position >= begin) & (position < end)) == axis.positive
        return found
