"""Error against run time: frames over exponents and models, in one table.

``python -m bench.accuracy [MESH ...]`` renders each mesh (the teapot by default) at 640x480 with every model
that the pipeline serves and exponents 1, 10, 100 and 1000. It prints a Markdown table of the arithmetic,
method and total error, each as the largest and the 99.9th percentile in LSB of an 8-bit channel, beside
clocks a pixel and simulated pixels a second.
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

__all__ = ["EXPONENTS", "main", "measure", "scene_for"]

EXPONENTS = (1, 10, 100, 1000)


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
    mesh: Mesh, model: str, exponents: Sequence[int] = EXPONENTS, width: int = 640, height: int = 480
) -> Iterator[tuple[int, SimulatedFrame, Comparison]]:
    """Frames of a mesh with one model, and their errors, for each exponent."""
    design = ShadingPipeline(model=model)
    simulator = FrameSimulator(design)
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        frame = simulator.render(scene)
        yield exponent, frame, compare(scene, design, frame)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; the exit status, 2 for a mesh that cannot be read."""
    sources = list(sys.argv[1:] if arguments is None else arguments) or ["teapot"]
    print("| mesh | model | exponent | arithmetic | method | total | clocks a pixel | Mpixel/s simulated |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for source in sources:
        try:
            loaded = load_mesh(source)
        except InputError as error:
            print(f"bench.accuracy: {error}", file=sys.stderr)
            return 2
        for model in METHODS["quadratic"]:
            for exponent, frame, result in measure(loaded.mesh, model):
                errors = (result.arithmetic_error, result.method_error, result.total_error)
                figures = " | ".join(f"{error.max_lsb:.2f} / {error.p999_lsb:.2f}" for error in errors)
                print(
                    f"| {loaded.name} | {model} | {exponent} | {figures} "
                    f"| {frame.clocks / max(frame.pixels, 1):.3f} "
                    f"| {frame.pixels / frame.seconds['simulate'] / 1e6:.2f} |"
                )
    return 0


if __name__ == "__main__":
    sys.exit(main())
