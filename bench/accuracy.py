"""Error against run time: frames over methods, models and exponents, in one table.

``python -m bench.accuracy [MESH ...]`` renders each mesh (the teapot by default) at 640x480 with every method
of the pipeline, and with several models by the chord method, at exponents 1, 10, 100 and 1000. It prints a
Markdown table of the arithmetic and the method error, the largest in LSB of an 8-bit channel, of the largest
total error at exponent 100, and of clocks a pixel and simulated pixels a second there.
"""

import sys
from collections.abc import Iterator, Sequence

from golden.camera import Camera
from golden.geometry import Mesh
from golden.lighting import Light, Material
from golden.pipeline import METHODS, ShadingPipeline
from golden.scene import Scene
from sim.errors import InputError
from sim.frame import Comparison, FrameSimulator, SimulatedFrame, compare
from sim.mesh import load_mesh

__all__ = ["DESIGNS", "EXPONENTS", "main", "measure", "row", "scene_for"]

EXPONENTS = (1, 10, 100, 1000)

DESIGNS = [(method, "cosquad") for method in METHODS]
DESIGNS += [("chord", model) for model in ("cosquad7", "cosquad_lin", "lyon3_refitted", "exp", "blinn")]
"""Method and model of each row."""


def scene_for(mesh: Mesh, exponent: int, width: int = 640, height: int = 480) -> Scene:
    """White light on a grey, glossy surface: every channel shows the whole error."""
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
) -> Iterator[tuple[int, SimulatedFrame, Comparison]]:
    """Frames of a mesh by one design, and their errors, for each exponent."""
    simulator = FrameSimulator(design)
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        frame = simulator.render(scene)
        yield exponent, frame, compare(scene, design, frame)


def row(name: str, mesh: Mesh, design: ShadingPipeline) -> str:
    """Line of the table of a mesh and a design."""
    cells = [name, design.method, design.model]
    for exponent, frame, result in measure(mesh, design):
        cells.append(f"{result.arithmetic_error.max_lsb:.2f} / {result.method_error.max_lsb:.2f}")
        if exponent == 100:
            total = f"{result.total_error.max_lsb:.1f}"
            clocks = f"{frame.clocks / max(frame.pixels, 1):.3f}"
            speed = f"{frame.pixels / frame.seconds['simulate'] / 1e6:.1f}"
    return f"| {' | '.join([*cells, total, clocks, speed])} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; the exit status, 2 for a mesh that cannot be read."""
    sources = list(sys.argv[1:] if arguments is None else arguments) or ["teapot"]
    exponents = " | ".join(f"n = {exponent}" for exponent in EXPONENTS)
    print(f"| mesh | method | model | {exponents} | total | clocks a pixel | Mpixel/s simulated |")
    print(f"|---|---|---|{'---:|' * (len(EXPONENTS) + 3)}")
    for source in sources:
        try:
            loaded = load_mesh(source)
        except InputError as error:
            print(f"bench.accuracy: {error}", file=sys.stderr)
            return 2
        for method, model in DESIGNS:
            print(row(loaded.name, loaded.mesh, ShadingPipeline(method, model)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
