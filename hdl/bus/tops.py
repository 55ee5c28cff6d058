"""The cores that a build asks for."""

from collections.abc import Callable
from dataclasses import dataclass

from amaranth.hdl import Value
from amaranth.lib import wiring

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.render import Renderer
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit, PixelPipelinesUnit
from blysk.hdl.render import RendererUnit

__all__ = ["TOPS", "Top"]


@dataclass(frozen=True)
class Top:
    """A core with streams ``i`` and ``o``.

    Parameters
    ----------
    title : str
        Input and output of the core, as in ``triangles to spans``.
    unit : callable
        Function that makes the core from a `ShadingPipeline`. Keywords go to the constructor of its unit.
    watch : callable
        Function that makes a signal from the core, before the core is elaborated. The signal is high while
        anything is inside, except a beat that waits at ``o``.
    """

    title: str
    unit: Callable[..., wiring.Component]
    watch: Callable[[wiring.Component], Value]


def _geometry(design: ShadingPipeline) -> GeometryUnit:
    return GeometryUnit(Renderer(design).geometry, design.build)


def _shader(design: ShadingPipeline) -> wiring.Component:
    if design.build.pipes == 1:
        return ShadingPipelineUnit(design)
    return (MergedPipelinesUnit if design.build.merged else PixelPipelinesUnit)(PixelPipelines(design))


def _render(design: ShadingPipeline, **options) -> RendererUnit:
    return RendererUnit(Renderer(design), clears=True, **options)


TOPS = {
    # A write is accepted while no span is inside.
    "shader": Top("spans to pixels", _shader, lambda core: ~core.write.ready),
    "geometry": Top("triangles to spans", _geometry, lambda core: ~core.idle),
    "render": Top("triangles to pixels", _render, lambda core: ~core.idle),
}
"""Cores by name, as in `Build`."""
