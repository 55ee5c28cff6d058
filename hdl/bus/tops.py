"""Cores that a bus can be put round."""

from collections.abc import Callable
from dataclasses import dataclass

from amaranth.hdl import Value
from amaranth.lib import wiring

from blysk.golden.geometry.geometry import Geometry
from blysk.golden.pipeline import Design
from blysk.golden.render import Renderer
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.render import RenderUnit

__all__ = ["TOPS", "Top"]


@dataclass(frozen=True)
class Top:
    """A core with streams ``i`` and ``o``.

    Parameters
    ----------
    title : str
        Its input and its output, as in ``triangles to spans``.
    unit : callable
        Makes the core from a `Design` or a `Renderer`; keywords go to its constructor.
    takes_triangles : bool
        Whether triangles go in, and ``unit`` takes a `Renderer`; else spans go in, and it takes a `Design`.
    watch : callable
        Makes a signal from the core, before it is elaborated: high while anything is inside, except a beat
        that waits at ``o``.
    """

    title: str
    unit: Callable[..., wiring.Component]
    takes_triangles: bool
    watch: Callable[[wiring.Component], Value]


def _geometry(parameters: Renderer, **options) -> GeometryUnit:
    geometry: Geometry = parameters.geometry
    compact = parameters.design.build.style == "compact"
    return GeometryUnit(geometry.grid, compact, geometry.lines, vectors=geometry.vectors, **options)


def _shader(parameters: Design) -> ShadingPipelineUnit:
    return ShadingPipelineUnit(parameters)


def _render(parameters: Renderer, **options) -> RenderUnit:
    return RenderUnit(parameters, clears=True, **options)


TOPS = {
    # A write is accepted while no span is inside.
    "shader": Top("spans to pixels", _shader, False, lambda core: ~core.write.ready),
    "geometry": Top("triangles to spans", _geometry, True, lambda core: ~core.idle),
    "render": Top("triangles to pixels", _render, True, lambda core: ~core.idle),
}
"""Cores by name; those of `PACKETS`."""
