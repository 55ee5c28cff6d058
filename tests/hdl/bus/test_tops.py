# amaranth: UnusedElaboratable=no
"""The cores that a build asks for."""

import pytest

from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.bus.bus import BusUnit, core_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit, PixelPipelinesUnit
from blysk.hdl.render import RendererUnit


@pytest.mark.parametrize("lights", [1, 2])
def test_geometry_alone_is_that_of_the_renderer(lights):
    """For several lights, geometry alone cuts vectors as the whole renderer does."""
    design = preset(lights=lights)
    model = Renderer(design).geometry
    assert model.rotates == (lights > 1)
    assert core_of(design.built(top="geometry")).model == model
    assert core_of(design.built(top="render")).geometry.model == model


def test_each_build_has_its_core():
    small = preset("linear", "cosquad")
    for build, kind in (
        ({}, ShadingPipelineUnit),
        ({"pipes": 2}, PixelPipelinesUnit),
        ({"pipes": 2, "merged": True}, MergedPipelinesUnit),
        ({"top": "render"}, RendererUnit),
        ({"bus": "wishbone"}, BusUnit),
    ):
        assert type(core_of(small.built(**build))) is kind
