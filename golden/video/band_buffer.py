"""Band buffer: one band of lines is drawn while another is shown, and the choice of the next band."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from blysk.golden.video.display_timing import VGA, DisplayMode

__all__ = ["RGB565", "RGB888", "BandBuffer"]

RGB888 = (8, 8, 8)
RGB565 = (5, 6, 5)
"""Numbers of bits of red, green and blue that a buffer keeps."""


@dataclass(frozen=True)
class BandBuffer:
    """Two bands of colour: one band is shown while the other is drawn. All other pixels are background.

    The *slot* of a band is the time in which the display shows its `lines` lines. A band that is incomplete
    when its slot begins is *late*. The display shows the background in its place, and the band is dropped
    when it is complete. The next band to draw follows the last band. If the slot of that band has begun, the
    band of the next slot is drawn (`following`). So each line of a frame is either right or background. The
    display's timing does not depend on the drawing.

    Colours are kept as their highest bits, ``channel >> (8 - bits)``, and shown with these bits repeated
    below. Black stays black, and white stays white. The error of a channel is at most ``2^(8 - bits) - 1``.

    Parameters
    ----------
    mode : DisplayMode
        Size of the picture.
    lines : int
        Number of lines of a band, a power of two that divides the picture into four bands or more.
    colour_bits : tuple of int
        `RGB888`, `RGB565` or others from 4 to 8.
    background : tuple of int
        Red, green and blue, 0 to 255.

    Raises
    ------
    ValueError
        If ``lines`` is not such a number, or the bits or the background are out of range.

    Source: docs/theory/video.md#bands.
    """

    mode: DisplayMode = VGA
    lines: int = 16
    colour_bits: tuple[int, int, int] = RGB888
    background: tuple[int, int, int] = (0, 0, 0)

    def __post_init__(self) -> None:
        height = self.mode.vertical.visible
        if self.lines < 2 or self.lines & (self.lines - 1) or height % self.lines or height < 4 * self.lines:
            raise ValueError(
                f"a band must have 2, 4, 8, ... lines, and {height} lines must be four bands or more"
            )
        if not all(4 <= bits <= 8 for bits in self.colour_bits):
            raise ValueError("a buffer must keep 4 to 8 bits of each channel")
        if not all(0 <= channel <= 255 for channel in self.background):
            raise ValueError("channels of the background are 0 to 255")

    @property
    def bands(self) -> int:
        """Bands of a picture."""
        return self.mode.vertical.visible // self.lines

    @property
    def pixels(self) -> int:
        """Pixels of a band."""
        return self.mode.horizontal.visible * self.lines

    @property
    def error(self) -> int:
        """Largest difference between a channel as drawn and the same channel as shown."""
        return (1 << 8 - min(self.colour_bits)) - 1

    def kept(self, colour: npt.ArrayLike) -> np.ndarray:
        """Codes of channels in the buffer, shape (..., 3)."""
        found: np.ndarray = np.asarray(colour) >> 8 - np.array(self.colour_bits)
        return found

    def shown(self, code: np.ndarray) -> np.ndarray:
        """Channels of 8 bits, shape (..., 3), from codes in the buffer."""
        bits = np.array(self.colour_bits)
        found: np.ndarray = np.asarray(code) << 8 - bits | np.asarray(code) >> 2 * bits - 8
        return found

    def compute(self, picture: np.ndarray, late: Collection[int] = ()) -> np.ndarray:
        """The shown frame for a drawn picture.

        Parameters
        ----------
        picture : int array, shape (height, width, 3)
            Channels of 8 bits, with the background where nothing is drawn.
        late : collection of int
            Indices of bands that were late.

        Raises
        ------
        ValueError
            If the picture has another size than the display, or an index is out of range.
        """
        size = (self.mode.vertical.visible, self.mode.horizontal.visible, 3)
        if np.shape(picture) != size:
            raise ValueError(f"a picture of the display has shape {size}, not {np.shape(picture)}")
        for wrong in set(late) - set(range(self.bands)):
            raise ValueError(f"bands are 0 to {self.bands - 1}, not {wrong}")
        shown = self.shown(self.kept(picture))
        for band in late:
            shown[band * self.lines : (band + 1) * self.lines] = self.shown(self.kept(self.background))
        return shown

    def following(self, band: np.ndarray, slot: np.ndarray) -> np.ndarray:
        """Band that is drawn after ``band``; ``slot`` is the last slot that has begun.

        With two buffers at most the bands of the next two slots are useful.
        """
        next_band = (band + 1) % self.bands
        ahead = (next_band - slot) % self.bands
        return np.where((ahead == 1) | (ahead == 2), next_band, (slot + 1) % self.bands)
