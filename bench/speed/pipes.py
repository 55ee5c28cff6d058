"""Pixels a cycle of several pipelines: how well the spans of meshes keep all of them busy.

``python -m blysk.bench.speed.pipes`` draws a coarse ring and teapots of about 1,000, 10,000 and 100,000
triangles at 640x480 by 1, 2, 4 and 8 simulated pipelines of the method quotient; pipeline k of n draws the
scanlines with y mod n = k. It prints a table in Markdown; ``--json`` prints the same as JSON. Every frame
must equal that of the bit-accurate model. The exit status is 1 if a frame differs, or if four pipelines give
less than 3.6 times the pixels a cycle of one on a mesh whose spans have four pixels or more on average.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.command import progress
from blysk.bench.ring import ring
from blysk.golden.build import PIPES
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import Mesh
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = ["LEAST", "MESHES", "Rate", "main", "measure", "mesh_of", "table"]

MESHES = ("ring", "teapot 1000", "teapot 10000", "teapot 100000")
"""Names of the meshes: a coarse ring, and teapots with their numbers of triangles, about."""

LEAST = 3.6
"""Target: least ratio of the pixels a cycle of `_OF` pipelines and of one."""

_OF = 4
_EXPONENT = 50
_METHOD = "quotient"


@dataclass(frozen=True)
class Rate:
    """A frame by several pipelines.

    Parameters
    ----------
    mesh : str
        One of `MESHES`.
    triangles : int
        Triangles of the mesh.
    pipes : int
        Number of pipelines.
    spans, pixels, cycles : int
        Numbers of the frame; cycles from the first write of a constant to the last pixel.
    same : bool
        Whether the picture is that of the bit-accurate model.
    """

    mesh: str
    triangles: int
    pipes: int
    spans: int
    pixels: int
    cycles: int
    same: bool

    @property
    def pixels_a_cycle(self) -> float:
        """Pixels a cycle."""
        return self.pixels / self.cycles

    @property
    def pixels_a_span(self) -> float:
        """Mean number of pixels of a span: one span a cycle gives at most so many pixels a cycle."""
        return self.pixels / self.spans


def mesh_of(name: str) -> Mesh:
    """A mesh of `MESHES`."""
    kind, _, triangles = name.partition(" ")
    return teapot(int(triangles)) if kind == "teapot" else ring(18, 9)


def measure(
    pipes: int, meshes: Sequence[str] = MESHES, width: int = 640, height: int = 480, method: str = _METHOD
) -> Iterator[Rate]:
    """Draw meshes by a number of pipelines: a rate for each mesh.

    Parameters
    ----------
    pipes : int
        Number of pipelines.
    meshes : sequence of str
        Some of `MESHES`.
    width, height : int
        Size of the pictures.
    method : str
        Method of the design, which has one light.
    """
    design = preset(method, model_of(method))
    simulator = FrameSimulator(design.built(pipes=pipes))
    for name in meshes:
        mesh = mesh_of(name)
        scene = scene_for(mesh, _EXPONENT, width, height)
        frame = simulator.render(scene)
        same = np.array_equal(frame.image, model_frame(scene, design).image)
        yield Rate(name, len(mesh.faces), pipes, frame.spans, frame.pixels, frame.cycles, same)


def times(rates: Sequence[Rate], rate: Rate) -> float:
    """Ratio of a rate's pixels a cycle to those of one pipeline; NaN if that was not measured."""
    ones = [one.cycles for one in rates if (one.mesh, one.pipes) == (rate.mesh, 1)]
    return ones[0] / rate.cycles if ones else float("nan")


def table(rates: Sequence[Rate]) -> str:
    """Table in Markdown, a line a mesh."""
    pipes = list(dict.fromkeys(rate.pipes for rate in rates))
    lines = [
        f"| mesh | triangles | pixels a span | {' | '.join(f'N = {n}' for n in pipes)} |",
        f"|---|---:|---:|{'---:|' * len(pipes)}",
    ]
    for name in dict.fromkeys(rate.mesh for rate in rates):
        of_mesh = [rate for rate in rates if rate.mesh == name]
        cells = [f"{rate.pixels_a_cycle:.3f} ({times(rates, rate):.2f}x)" for rate in of_mesh]
        first = of_mesh[0]
        shape = f"{first.mesh.split()[0]} | {first.triangles:,} | {first.pixels_a_span:.2f}"
        lines.append(f"| {shape} | {' | '.join(cells)} |")
    return "\n".join(lines)


def missed(rates: Sequence[Rate]) -> list[str]:
    """Frames that differ and targets that are missed, in lines."""
    lines = [f"{r.mesh}, {r.pipes} pipelines: the picture is another" for r in rates if not r.same]
    return lines + [
        f"{rate.mesh}: {times(rates, rate):.2f} times with {_OF} pipelines, not {LEAST}"
        for rate in rates
        if rate.pipes == _OF <= rate.pixels_a_span and times(rates, rate) < LEAST
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, and compare with the targets.

    Returns
    -------
    int
        0, or 1 when a target is missed.
    """
    parser = argparse.ArgumentParser(
        prog="blysk.bench.speed.pipes", description="pixels a cycle of several pipelines"
    )
    parser.add_argument("--meshes", nargs="+", choices=MESHES, default=MESHES)
    parser.add_argument("--pipes", nargs="+", type=int, choices=PIPES, default=PIPES)
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=480)
    parser.add_argument("--method", default=_METHOD)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    rates = [
        rate
        for pipes in progress(options.pipes, total=len(options.pipes), unit="counts of pipelines")
        for rate in measure(pipes, options.meshes, options.width, options.height, options.method)
    ]
    if options.json:
        each = [asdict(rate) | {"pixels_a_cycle": rate.pixels_a_cycle} for rate in rates]
        json.dump(each, sys.stdout)
        print()
    else:
        print(table(rates))
    problems = missed(rates)
    for line in problems:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
