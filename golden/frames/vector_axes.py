"""Axes of the vectors that a method takes: the frames of a scene's lights."""

import numpy as np

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.light_frame import light_frames
from blysk.golden.reference.scene import Scene

__all__ = ["further_axes", "triangle_axes", "vector_axes"]


def vector_axes(scene: Scene, design: ShadingPipeline) -> np.ndarray:
    """Axes, as rows in the scene's frame, of the components of ``N/W`` that a method takes.

    Without highlights z is along each light.

    Parameters
    ----------
    scene : Scene
        Lights and viewer.
    design : ShadingPipeline
        The pipeline, of a method that takes vectors.

    Returns
    -------
    float64 array, shape (components, 3)
        In the order of `QuotientSpans.components`.
    """
    model = design.vector_spans
    frames = light_frames(scene, design.lights)
    rows: dict[str, np.ndarray] = {}
    for k, frame in enumerate(frames):
        x, y, z = frame.axes_for(model.highlights)
        if model.mirror:
            rows.setdefault("s0", frame.sine * y)
            y = frame.cosine * y
        rows |= {f"x{k}": x, f"y{k}": y, f"z{k}": z}
    return np.stack([rows[name] for name in model.components])


def triangle_axes(scene: Scene, design: ShadingPipeline) -> np.ndarray | None:
    """Axes of the normals that triangles have, see `Interpolator.triangle_axes`."""
    return design.interpolator.triangle_axes(scene, design.lights, design.specular is not None)


def further_axes(scene: Scene, design: ShadingPipeline) -> np.ndarray:
    """Axes of further lights in the frame of the first, as `FrameConstants` has them, in float64.

    Parameters
    ----------
    scene, design
        As for `vector_axes`, with two lights at least.

    Returns
    -------
    float64 array, shape (lights - 1, rows, 3)
    """
    first = light_frames(scene, 1)[0].axes_for(design.vector_spans.highlights)
    rows = vector_axes(scene, design) @ first.T
    found: np.ndarray = rows[3 : len(rows) - design.vector_spans.mirror].reshape(design.lights - 1, -1, 3)
    return found
