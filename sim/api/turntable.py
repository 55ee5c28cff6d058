"""Turntables: the camera goes once around the mesh, about the axis that points up."""

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack, overload

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.scene import Scene
from blysk.sim.api.design import refused_counts
from blysk.sim.api.options import DESIGN, MAX_FRAMES, RENDERING, SCENE, Engine, Option, RenderOptions, Source
from blysk.sim.api.render import Progress, Rendering, prepared
from blysk.sim.api.rendered_frame import RenderedFrame
from blysk.sim.api.settings import checked
from blysk.sim.api.signature import with_options
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import write_gif
from blysk.sim.frames.picture import write_image
from blysk.sim.output import check_writable
from blysk.sim.run_files import RunFiles
from blysk.sim.value_types import Whole

__all__ = ["Turntable", "turntable"]


@dataclass(frozen=True)
class Turntable(Sequence[RenderedFrame]):
    """Frames of a turntable. Each frame is drawn on request, and not kept.

    Parameters
    ----------
    ready : Rendering
        The pipeline and the scenes.
    files : RunFiles
        Files that were read. `save` does not replace them.
    """

    ready: Rendering
    files: RunFiles

    def __repr__(self) -> str:
        scene, design = self.ready.scenes[0], self.ready.design
        return (
            f"<Turntable {self.ready.loaded.name} {len(self)} frames {scene.width}x{scene.height}, "
            f"{design.method}, {design.model}>"
        )

    def __len__(self) -> int:
        return len(self.ready.scenes)

    @overload
    def __getitem__(self, index: int) -> RenderedFrame: ...

    @overload
    def __getitem__(self, index: slice) -> list[RenderedFrame]: ...

    def __getitem__(self, index: int | slice) -> RenderedFrame | list[RenderedFrame]:
        """A frame, or the frames of a slice in a list."""
        if isinstance(index, slice):
            return [self[number] for number in range(len(self))[index]]
        with self.files.active():
            return self.ready.render(index=range(len(self))[index])

    def save(
        self, path: str | os.PathLike[str], milliseconds: int = 50, progress: Progress | None = None
    ) -> None:
        """Draw all frames, and write them as an animated GIF that repeats forever.

        Parameters
        ----------
        path : path
            The file, with the suffix ``.gif``.
        milliseconds : int
            Time that each frame is shown, in steps of 10.
        progress : callable, optional
            Called after each frame with the number of frames drawn and the number of all frames.

        Raises
        ------
        InputError
            If the name has another suffix, or the file cannot be written or was read for the frames.
        """
        if Path(path).suffix.lower() != ".gif":
            raise InputError(os.fspath(path), "the animation is a GIF", "use a name that ends in .gif")
        with self.files.active(), tempfile.TemporaryDirectory(prefix="blysk-") as folder:
            check_writable(path)
            pictures = []
            for number, frame in enumerate(self, 1):
                pictures.append(Path(folder, f"{number:04}.png"))
                write_image(pictures[-1], frame.image)
                if progress:
                    progress(number, len(self))
            write_gif(path, pictures, milliseconds)


@with_options({**SCENE, **DESIGN, **RENDERING}, RenderOptions)
def turntable(
    source: Source | Scene = "teapot",
    frames: int = 36,
    *,
    design: ShadingPipeline | None = None,
    engine: Engine = "auto",
    **options: Unpack[RenderOptions],
) -> Turntable:
    """Frames of a camera that goes once around a mesh in equal steps. `render` gives the first frame.

    The lights do not move. This function draws in the calling process. ``blysk render --frames`` draws in
    several processes or on several machines::

        blysk.turntable("teapot", 24, size="320x240").save("teapot.gif")

    Parameters
    ----------
    source, design, engine
        As for `render`.
    frames : int
        Number of frames, 1 to 9999.
    **options
        Options below, as for `render`.

    Returns
    -------
    Turntable
        A sequence of `RenderedFrame`, each drawn on request, with `Turntable.save`.

    Raises
    ------
    InputError, SimulationError
        As `render`; also if the camera looks along its axis of rotation.
    """
    count = checked({"frames": frames}, {"frames": Option(Whole(1, MAX_FRAMES), 36, "")})["frames"]
    files = RunFiles.current()
    with files.active(), refused_counts(design):
        return Turntable(prepared(source, design, engine, options, frames=count), files)
