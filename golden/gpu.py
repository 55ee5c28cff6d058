"""From a mesh in memory to the frames of a monitor: the bit-accurate model."""

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from blysk.golden.bus.loader import Loader
from blysk.golden.video.band_buffer import BandBuffer
from blysk.golden.video.draw_unit import Drawing

__all__ = ["Gpu"]


@dataclass(frozen=True)
class Gpu:
    """Bit-accurate model of a GPU: a drawing, shown on a display through a band buffer.

    Parameters
    ----------
    drawing : Drawing
        The drawing unit. Its picture has the size of the display.
    buffer : BandBuffer
        Band buffer: display mode, lines of a band, colours, background. A band has as many lines as a band of
        the drawing.
    loader : Loader, optional
        Loader of the drawing's memories. ``None``: they keep their words.

    Raises
    ------
    ValueError
        If drawing and buffer differ in the size of the picture or in the lines of a band. If the loader is
        for other memories.

    Source: docs/theory/video.md#bands.
    """

    drawing: Drawing
    buffer: BandBuffer = field(default_factory=BandBuffer)
    loader: Loader | None = None

    def __post_init__(self) -> None:
        if self.drawing.size != self.buffer.mode.size or self.drawing.lines != self.buffer.lines:
            raise ValueError(
                f"the drawing has {self.drawing.size} pixels in bands of {self.drawing.lines} lines, "
                f"the display {self.buffer.mode.size} in bands of {self.buffer.lines}"
            )
        if self.loader is not None and self.loader.decoder.memories != self.drawing.memories:
            raise ValueError("the loader is for the memories of another drawing")

    def frames(self, count: int) -> np.ndarray:
        """Frames from power-up, without buttons, late bands or packets; shape (count, height, width, 3)."""
        controls, result = self.drawing.controls, []
        state = controls.start
        for _ in range(count):
            state = controls.advance(state)
            result.append(self.frame(state.angle, controls.list_of(state)))
        return np.array(result)

    def frame(self, angle: int, preset: int = 0, late: Collection[int] = ()) -> np.ndarray:
        """The frame of an angle and a list, with bands that are late."""
        picture = self.drawing.picture(angle, preset, self.buffer.background)
        return self.buffer.compute(picture, late).astype(np.uint8)
