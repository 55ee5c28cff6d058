"""The frames for measurements of errors: scene, designs, exponents."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import METHODS, PUBLISHED
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene

if TYPE_CHECKING:
    from blysk.golden.frames.compare import Comparison
    from blysk.sim.frames.frame import SimulatedFrame

__all__ = ["DESIGNS", "EXPONENTS", "measure", "model_of", "scene_for"]

EXPONENTS = (1, 10, 100, 1000)


def model_of(method: str) -> str:
    """Reflection model with which a method is compared with other methods.

    The model is ``cosquad`` of the documents. It is ``blinn`` if the method's highlights always come from a
    table.
    """
    return "blinn" if (METHODS | PUBLISHED)[method].needs_table else "cosquad"


_MODELS = ("cosquad7", "cosquad_lin", "lyon3_refitted", "exp", "blinn_product", "blinn")

DESIGNS = [("quotient", "blinn"), ("quotient", "phong")]
DESIGNS += [(method, model_of(method)) for method in METHODS if method != "quotient"]
DESIGNS += [("renormalise", model) for model in _MODELS]
"""Method and model of each row of the table of errors in docs/guide/accuracy.md."""


def scene_for(mesh: Mesh, exponent: int, width: int = 640, height: int = 480) -> Scene:
    """Scene of a grey, glossy mesh in white light, so that every channel shows the whole error."""
    return Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), "perspective", width / height),
        width=width,
        height=height,
        material=Material((0.05,) * 3, (0.4,) * 3, (0.55,) * 3, exponent),
        lights=[Light((-0.5, 0.8, 0.7))],
    )


def measure(
    mesh: Mesh,
    design: ShadingPipeline,
    exponents: Sequence[int] = EXPONENTS,
    width: int = 640,
    height: int = 480,
) -> Iterator[tuple[int, "SimulatedFrame", "Comparison"]]:
    """Frames of a mesh by one design, and their errors, for each exponent."""
    # These imports take a second, and a list of the designs does not need them.
    from blysk.golden.frames.compare import compare
    from blysk.sim.frames.frame import FrameSimulator

    simulator = FrameSimulator(design)
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        frame = simulator.render(scene)
        yield exponent, frame, compare(scene, design, frame)
