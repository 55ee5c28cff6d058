"""Comparison of designs from triangles to pixels: exact normals with chord, exact lines with renormalisation.

`python -m blysk.bench.report.geometry` prints the table of docs/theory/geometry.md: costs before synthesis,
cycles of simulated frames, and errors of the bit-accurate models, which are those of the hardware.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import click
import numpy as np

from blysk.bench.command import run
from blysk.golden.frames.compare import compare_image
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.hdl.render import RenderUnit
from blysk.sim.api.scene import scene
from blysk.sim.errors import InputError
from blysk.sim.frames.triangles import SimulatedTriangleFrame, TriangleSimulator

__all__ = ["CANDIDATES", "Candidate", "cost", "frames", "largest_error", "main"]

SIZE = 640, 480
TRIANGLES = 10_712, 1000
EXPONENTS = 1, 20, 100, 1000


@dataclass(frozen=True)
class Candidate:
    """A design from triangles to pixels.

    Parameters
    ----------
    method : str
        Method of shading.
    style : str
        Style of geometry and shading.
    setup_interval : int or None
        Setup interval of shading.
    setups : int
        Lanes of the triangle setup.
    """

    method: str
    style: str = "throughput"
    setup_interval: int | None = None
    setups: int = 1

    @property
    def renderer(self) -> Renderer:
        """Its bit-accurate model, of one light and the model cosquad, for pictures of `SIZE`."""
        options = {"style": self.style, "setup_interval": self.setup_interval}
        return Renderer(preset(self.method, "cosquad", x_bits=10, y_bits=9, **options))

    @property
    def unit(self) -> RenderUnit:
        """Its hardware, without the memory of depths."""
        return RenderUnit(self.renderer, setups=self.setups)


CANDIDATES = {
    "chord": Candidate("chord"),
    "chord, two lanes": Candidate("chord", setups=2),
    "renormalise": Candidate("renormalise", setup_interval=2),
    "renormalise, two lanes": Candidate("renormalise", setup_interval=2, setups=2),
    "chord, compact": Candidate("chord", style="compact"),
    "renormalise, compact": Candidate("renormalise", style="compact"),
}
"""Designs to compare, by name."""


def cost(candidate: Candidate) -> tuple[int, Cost]:
    """Multipliers of geometry, and the cost of the whole, before synthesis."""
    unit = candidate.unit
    return unit.geometry.multipliers, cost_of(unit)


def _scene(triangles: int, size: tuple[int, int] = SIZE, exponent: int = 50) -> Scene:
    return scene("teapot", size=size, triangles=triangles, exponent=exponent)


def frames(candidate: Candidate) -> Iterator[SimulatedTriangleFrame]:
    """Frames of the teapot by the simulated hardware, by number of triangles."""
    simulator = TriangleSimulator(candidate.renderer, SIZE, setups=candidate.setups)
    for triangles in TRIANGLES:
        yield simulator.render(_scene(triangles))


def largest_error(candidate: Candidate, triangles: int) -> float:
    """Largest method error over `EXPONENTS` in LSB: against exact normals at every pixel, same model."""
    renderer, errors = candidate.renderer, []
    for exponent in EXPONENTS:
        drawn = _scene(triangles, exponent=exponent)
        image = triangle_frame(drawn, renderer).image
        errors.append(compare_image(drawn, renderer.design, image).method_error.max_lsb)
    return float(np.max(errors))


@click.command()
@click.option("--only", multiple=True, help="Designs by name; all, if not given.")
@click.option("--simulate/--no-simulate", default=True, help="Cycles, which takes minutes for each design.")
def command(only: tuple[str, ...], simulate: bool) -> int:
    """Print the table, row by row."""
    for name in only:
        if name not in CANDIDATES:
            raise InputError(f"--only {name}", "unknown design", f"use one of {', '.join(CANDIDATES)}")
    titles = ["design", "multipliers", "of geometry", "register bits", "memory bits"]
    titles += [f"cycles a pixel, {count:,}" for count in TRIANGLES] if simulate else []
    titles += [f"error, {count:,}" for count in TRIANGLES]
    click.echo(f"| {' | '.join(titles)} |")
    click.echo(f"| --- |{' ---: |' * (len(titles) - 1)}")
    for name in only or CANDIDATES:
        candidate = CANDIDATES[name]
        geometry, whole = cost(candidate)
        totals = whole.totals
        words = [name, totals["multipliers"], geometry, totals["register_bits"], totals["memory_bits"]]
        cells = [str(word) if isinstance(word, str) else f"{word:,}" for word in words]
        if simulate:
            cells += [f"{frame.cycles:,} / {frame.cycles / frame.pixels:.3f}" for frame in frames(candidate)]
        cells += [f"{largest_error(candidate, count):.2f}" for count in TRIANGLES]
        click.echo(f"| {' | '.join(cells)} |")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command."""
    return run(command, "blysk.bench.report.geometry", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
