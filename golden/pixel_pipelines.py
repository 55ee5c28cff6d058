"""Several shading pipelines that take spans of different scanlines, and their bit-accurate model."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.pipeline import Pixels, ShadingPipeline, Spans

__all__ = ["PixelPipelines"]


@dataclass(frozen=True)
class PixelPipelines:
    """Shading pipelines of one design, of which pipeline k takes the scanlines y with ``y mod pipes = k``.

    The pixels are the same as with one pipeline. All pixels of a scanline come from one pipeline, in the
    order of its spans; pixels of different scanlines may come in any order.

    Parameters
    ----------
    design : ShadingPipeline
        Design of every pipeline; its `Build` has their number, at most the scanlines that the design has.

    Raises
    ------
    ValueError
        If there are more pipelines than scanlines.

    Source: docs/theory/units.md#pipeline.
    """

    design: ShadingPipeline = field(default_factory=lambda: ShadingPipeline().built(pipes=4))

    def __post_init__(self) -> None:
        if self.pipes > 1 << self.design.y_bits:
            rows = 1 << self.design.y_bits
            raise ValueError(f"pipes must be at most the number of scanlines, {rows}, not {self.pipes}")

    @property
    def pipes(self) -> int:
        """Number of pipelines."""
        return self.design.build.pipes

    def pipe_of(self, y: np.ndarray) -> np.ndarray:
        """Index of the pipeline of each scanline: y mod `pipes`."""
        return np.asarray(y) % self.pipes

    def compute(self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]) -> Pixels:
        """Bit-accurate pixels of the merged stream in the order of the spans; see `ShadingPipeline`."""
        return self.design.compute(spans, constants)

    def compute_each(
        self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]
    ) -> tuple[Pixels, ...]:
        """Bit-accurate pixels of each pipeline, in the order of its spans.

        Parameters
        ----------
        spans, constants
            As for `ShadingPipeline.compute`.
        """
        pipe = self.pipe_of(spans.y)
        return tuple(self.design.compute(spans[pipe == k], constants) for k in range(self.pipes))
