"""Pixels a cycle of several pipelines. They show how busy the spans of meshes keep the pipelines.

A coarse ring and teapots of about 1,000, 10,000 and 100,000 triangles are drawn by simulated pipelines.
Pipeline k of n draws the scanlines with y mod n = k. ``blysk bench --only several-pipelines`` has the table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.ring import ring
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import Mesh
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = ["MESHES", "Rate", "measure", "mesh_of", "times"]

MESHES = ("ring", "teapot 1000", "teapot 10000", "teapot 100000")
"""Names of the meshes: a coarse ring, and teapots with approximate numbers of triangles."""

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
        Numbers of the frame. Cycles go from the first write of a constant to the last pixel.
    same : bool
        Whether the picture equals the picture of the bit-accurate model.
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
        """Mean number of pixels of a span. A span comes in each cycle, so this limits the pixels a cycle."""
        return self.pixels / self.spans


def mesh_of(name: str) -> Mesh:
    """A mesh of `MESHES`."""
    kind, _, triangles = name.partition(" ")
    return teapot(int(triangles)) if kind == "teapot" else ring(18, 9)


def measure(
    pipes: int, meshes: Sequence[str] = MESHES, width: int = 640, height: int = 480, method: str = _METHOD
) -> Iterator[Rate]:
    """Draw meshes by a number of pipelines, and give a rate for each mesh.

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
    """Pixels a cycle over the pixels a cycle of a single pipeline. NaN if this was not measured."""
    ones = [one.cycles for one in rates if (one.mesh, one.pipes) == (rate.mesh, 1)]
    return ones[0] / rate.cycles if ones else float("nan")
