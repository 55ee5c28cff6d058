"""blysk: Phong and Blinn shading as RTL in Amaranth, simulated beside a NumPy golden renderer.

::

    import blysk

    frame = blysk.render("teapot", exponent=200)
    frame.save("teapot.png")
    print(frame.error.max_lsb, frame.cycles)
    text = blysk.verilog(blysk.design(lights=2))
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blysk.golden.presets import METHOD_LINES as METHODS
    from blysk.golden.presets import MODEL_LINES as MODELS
    from blysk.golden.reference.camera import Camera
    from blysk.golden.reference.geometry import Mesh
    from blysk.golden.reference.lighting import Light, Material
    from blysk.golden.reference.scene import Scene
    from blysk.golden.reference.texture import Texture
    from blysk.sim.api.costed_design import Design
    from blysk.sim.api.design import design
    from blysk.sim.api.render import render
    from blysk.sim.api.rendered_frame import RenderedFrame
    from blysk.sim.api.scene import scene
    from blysk.sim.api.turntable import Turntable, turntable
    from blysk.sim.api.verilog import verilog
    from blysk.sim.errors import CompilerMissing, InputError, SimulationError

__all__ = [
    "METHODS",
    "MODELS",
    "Camera",
    "CompilerMissing",
    "Design",
    "InputError",
    "Light",
    "Material",
    "Mesh",
    "RenderedFrame",
    "Scene",
    "SimulationError",
    "Texture",
    "Turntable",
    "design",
    "render",
    "scene",
    "turntable",
    "verilog",
]

# Imported at first use: importing the simulators takes a second.
_MODULES = {
    "METHODS": "golden.presets",
    "MODELS": "golden.presets",
    "Camera": "golden.reference.camera",
    "CompilerMissing": "sim.errors",
    "Design": "sim.api.costed_design",
    "InputError": "sim.errors",
    "Light": "golden.reference.lighting",
    "Material": "golden.reference.lighting",
    "Mesh": "golden.reference.geometry",
    "RenderedFrame": "sim.api.rendered_frame",
    "Scene": "golden.reference.scene",
    "SimulationError": "sim.errors",
    "Texture": "golden.reference.texture",
    "Turntable": "sim.api.turntable",
    "design": "sim.api.design",
    "render": "sim.api.render",
    "scene": "sim.api.scene",
    "turntable": "sim.api.turntable",
    "verilog": "sim.api.verilog",
}

_LINES = {"METHODS": "METHOD_LINES", "MODELS": "MODEL_LINES"}
"""Names of the tables with a line about each method and model, which the golden layer has under others."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'blysk' has no attribute {name!r}")
    value = getattr(import_module(f"blysk.{_MODULES[name]}"), _LINES.get(name, name))
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
