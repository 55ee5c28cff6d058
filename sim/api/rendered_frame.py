"""A frame of a simulated pipeline, with its errors and figures."""

import base64
import html
import io
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from PIL import Image

from blysk.golden.frames.compare import Comparison, FrameErrors, compare, compare_triangles
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.metrics import error_map
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import SPACES
from blysk.golden.render import Renderer
from blysk.sim.frames.figures import frame_figures, triangle_figures
from blysk.sim.frames.frame import SimulatedFrame
from blysk.sim.frames.picture import write_comparison, write_image
from blysk.sim.frames.summary import frame_lines, specialisation_lines
from blysk.sim.frames.triangles import SimulatedTriangleFrame
from blysk.sim.run_files import RunFiles

__all__ = ["RenderedFrame"]


@dataclass(frozen=True)
class RenderedFrame:
    """A frame of a simulated pipeline. A notebook shows its picture and its figures.

    Parameters
    ----------
    scene : Scene
        The scene that was drawn.
    design : Design
        The pipeline. If it was specialised, this is the full pipeline.
    simulated : SimulatedFrame or SimulatedTriangleFrame
        The hardware's frame, from spans or from triangles.
    name : str
        Name of the mesh.
    details : dict
        ``ignored`` and ``counts`` of `LoadedMesh`, ``seconds`` of `Rendering`, and ``specialisation`` if
        there is a specialisation.
    files : RunFiles
        Files that were read. `save` does not replace them.
    """

    scene: Scene
    design: ShadingPipeline
    simulated: SimulatedFrame | SimulatedTriangleFrame
    name: str
    details: dict[str, Any]
    files: RunFiles = field(default_factory=RunFiles)

    @property
    def image(self) -> np.ndarray:
        """The picture, uint8, shape (height, width, 3)."""
        return self.simulated.image

    @property
    def error(self) -> FrameErrors:
        """Errors against exact normals at every pixel with the same reflection model, in LSB and dB.

        An LSB is a step of the picture's codes, of sRGB or of linear light (``comparison.transfer``).
        """
        return self.comparison.method_error

    @property
    def total_error(self) -> FrameErrors:
        """Errors against exact shading with the model that the design stands for, see `target_of`.

        For a lobe from a table this is the lobe's own model, and the errors equal `error`. For other models
        it is Blinn's power, and the errors include the error of the reflection model.
        """
        return self.comparison.total_error

    @cached_property
    def error_map(self) -> np.ndarray:
        """Largest error of each pixel's channels in LSB, as in `error`; float64, shape (height, width)."""
        return error_map(self.image, self.comparison.golden)

    @property
    def cycles(self) -> int:
        """Cycles from the first write of a constant to the last pixel.

        A frame of triangles counts from the first triangle until the hardware is empty.
        """
        return self.simulated.cycles

    @property
    def spans(self) -> int:
        """Number of spans that entered the shading pipeline."""
        return self.simulated.spans

    @property
    def pixels(self) -> int:
        """Number of pixels that left the shading pipeline, including hidden pixels."""
        return self.simulated.pixels

    @property
    def engine(self) -> str:
        """Simulator that ran: ``"cxxrtl"`` or ``"pysim"``."""
        return self.simulated.engine

    @cached_property
    def comparison(self) -> Comparison:
        """The golden frame, and the errors against three references.

        A frame of triangles has two references.
        """
        if isinstance(self.simulated, SimulatedTriangleFrame):
            drawn = self.simulated
            return compare_triangles(self.scene, Renderer(self.design), drawn.sent, drawn.image)
        return compare(self.scene, self.design, self.simulated)

    @cached_property
    def figures(self) -> dict[str, Any]:
        """Every figure that the command line prints, by name."""
        if isinstance(self.simulated, SimulatedTriangleFrame):
            figures = triangle_figures(self.scene, self.design, self.simulated, self.comparison)
        else:
            figures = frame_figures(self.scene, self.design, self.simulated, self.comparison)
        return {
            "mesh": self.name,
            **figures,
            **self.details,
            "counts": {**self.details["counts"], **figures["counts"]},
            "seconds": {**self.details["seconds"], **figures["seconds"]},
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture. The suffix chooses the format.

        Raises
        ------
        InputError
            If the suffix names no picture format, or the file cannot be written or was read for the frame.
        """
        with self.files.active():
            write_image(path, self.image)

    def save_comparison(self, path: str | os.PathLike[str]) -> None:
        """Write a picture that shows simulated frame, golden frame and error map side by side; see `save`."""
        parameter = self.design.highlight_parameter(self.scene.materials[0])
        name = self.design.specular.reflection.PARAMETER if self.design.specular else "exponent"
        highlight = "" if name is None else f", {name} {parameter:.4g}"
        subtitle = "no pixel shows the surface"
        if self.figures["visible_pixels"]:
            subtitle = (
                "simulated RTL beside exact normals of every pixel, same model, in float64: largest error "
                f"{self.error.max_lsb:.2f} LSB of {SPACES[self.comparison.transfer]}, "
                f"{self.cycles:,} cycles for {self.pixels:,} pixels"
            )
        title = f"{self.name}: {self.design.method}, {self.design.model}{highlight}"
        with self.files.active():
            golden, transfer = self.comparison.golden, self.comparison.transfer
            write_comparison(path, self.image, golden, title=title, subtitle=subtitle, transfer=transfer)

    def lines(self) -> Iterator[str]:
        """The figures as the command line prints them."""
        yield from frame_lines(self.figures)
        if "specialisation" in self.figures:
            yield from specialisation_lines(self.figures["specialisation"])

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        height, width, _ = self.image.shape
        return (
            f"<RenderedFrame {self.name} {width}x{height}, {self.design.method}, {self.design.model}, "
            f"{self.cycles:,} cycles>"
        )

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        Image.fromarray(self.image).save(file, format="PNG")
        return file.getvalue()

    def _repr_html_(self) -> str:
        picture = base64.b64encode(self._repr_png_()).decode()
        rows = {
            "method": f"{self.design.method}, {self.design.model}",
            "cycles": f"{self.cycles:,}",
            "spans": f"{self.spans:,}",
            "pixels": f"{self.pixels:,}",
            "largest error against exact normals, same model": (
                f"{self.error.max_lsb:.3f} LSB of {SPACES[self.comparison.transfer]}"
            ),
            "PSNR": f"{self.error.psnr_db:.2f} dB",
        }
        table = "".join(
            f"<tr><th>{key}</th><td>{html.escape(value)}</td></tr>" for key, value in rows.items()
        )
        alternative = html.escape(f"{self.name}, simulated")
        return (
            f'<figure><img alt="{alternative}" src="data:image/png;base64,{picture}">'
            f"<figcaption><table>{table}</table></figcaption></figure>"
        )
