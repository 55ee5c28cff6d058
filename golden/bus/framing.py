"""Framing of streams: the first and the last beat of a frame or a packet in a core's output."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from blysk.golden.bus.byte_layout import ByteLayout

__all__ = ["PACKETS", "Framing"]

PACKETS = {"shader": "span", "geometry": "frame", "render": "run"}
"""For each core the packet that TLAST ends: a span, a frame, or a run of pixels side by side in a row."""


@dataclass(frozen=True)
class Framing:
    """Bit-accurate model of a core between two streams of bytes.

    Parameters
    ----------
    given : ByteLayout
        Layout of the input payload.
    made : ByteLayout
        Layout of the output payload.
    packets : str
        Kind of packet, one of the values of `PACKETS`.

    Raises
    ------
    ValueError
        If ``packets`` is unknown.

    Source: docs/theory/bus.md#streams.
    """

    given: ByteLayout
    made: ByteLayout
    packets: str = "span"

    def __post_init__(self) -> None:
        if self.packets not in PACKETS.values():
            raise ValueError(f"packets must be one of {', '.join(PACKETS.values())}, not {self.packets!r}")

    def compute(self, beats: Mapping[str, np.ndarray], frame: np.ndarray) -> dict[str, np.ndarray]:
        """Output beats: ``data``, ``last`` of a packet, and ``first`` and ``end`` of a frame.

        Parameters
        ----------
        beats : mapping of str to int array
            Output beats of the core, by field; with ``last`` if packets are spans.
        frame : int array, shape (N,)
            Number of each beat's frame, in ascending order.
        """
        border = np.diff(frame) != 0
        first, end = np.r_[True, border][: len(frame)], np.r_[border, True][: len(frame)]
        if self.packets == "span":
            last = np.asarray(beats["last"]).astype(bool)
        elif self.packets == "run":
            neighbours = (np.diff(beats["x"]) == 1) & (np.diff(beats["y"]) == 0)
            last = end | np.r_[~neighbours, True][: len(frame)]
        else:
            last = end
        flags = {"last": last, "first": first, "end": end}
        return {"data": self.made.pack(beats)} | {name: flag.astype(int) for name, flag in flags.items()}
