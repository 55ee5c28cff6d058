"""A shaded frame: its picture, and the frame by a pipeline's bit-accurate model."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from blysk.golden.frames.prepare import PreparedFrame, prepare
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import encode

__all__ = ["Picture", "background_code", "frame_buffer", "model_frame"]


@dataclass(frozen=True)
class Picture:
    """A scene's picture, made of the pixels of a pipeline.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer, after the depth test.
    prepared : PreparedFrame
        The pipeline's spans.
    out_of_range_spans : int
        Spans with a larger angle than the method serves, as the pipeline reports.
    seconds : dict
        Time by step: ``raster`` (rasterise, cut, quantise), and ``model`` or ``simulate`` for the pixels.
    """

    image: np.ndarray
    prepared: PreparedFrame
    out_of_range_spans: int
    seconds: dict[str, float]

    @property
    def raster(self) -> Raster:
        """The rasteriser's spans."""
        return self.prepared.raster

    @property
    def cut_raster(self) -> Raster:
        """The pipeline's spans before quantisation."""
        return self.prepared.cut_raster

    @property
    def spans(self) -> int:
        """Number of spans on the pipeline's input."""
        return len(self.cut_raster.length)

    @property
    def pixels(self) -> int:
        """Number of pixels on the pipeline's output, hidden pixels included."""
        return len(self.cut_raster.span)


def background_code(scene: Scene, transfer: str) -> np.ndarray:
    """Codes of a scene's background, uint8, shape (3,): the encoded background, rounded half up."""
    codes: np.ndarray = np.floor(255 * encode(scene.background, transfer) + 0.5).astype(np.uint8)
    return codes


def frame_buffer(scene: Scene, raster: Raster, colors: np.ndarray, transfer: str) -> np.ndarray:
    """Frame buffer with the colours of the visible fragments over the background.

    Parameters
    ----------
    scene : Scene
        Size and background.
    raster : Raster
        Fragments, with flags of the visible fragments.
    colors : uint8 array, shape (fragments, 3)
        Red, green, blue of each fragment.
    transfer : str
        Transfer of the colours, by which the background is encoded, see `background_code`.

    Returns
    -------
    uint8 array, shape (height, width, 3)
    """
    image = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    image[...] = background_code(scene, transfer)
    image.reshape(-1, 3)[raster.pixel[raster.visible]] = colors[raster.visible]
    return image


def model_frame(scene: Scene, design: ShadingPipeline) -> Picture:
    """Frame by a pipeline's bit-accurate model, equal to the simulated pipeline's image bit for bit.

    Parameters
    ----------
    scene : Scene
        The scene, with at most as many lights as the design has, and as many materials.
    design : ShadingPipeline
        The pipeline.

    Raises
    ------
    ValueError
        As `prepare` does.
    """
    start = perf_counter()
    prepared = prepare(scene, design)
    rastered = perf_counter()
    pixels = design.compute(prepared.spans, prepared.constants)
    return Picture(
        image=frame_buffer(scene, prepared.cut_raster, pixels.color, design.transfer),
        prepared=prepared,
        out_of_range_spans=pixels.out_of_range_spans,
        seconds={"raster": rastered - start, "model": perf_counter() - rastered},
    )
