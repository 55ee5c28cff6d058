"""Record of the render unit: triangles to pixels."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.operands import unit_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.triangles import ended, frame_of, random_triangles
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.frames.prepare import with_tables
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.render import RendererUnit
from blysk.sim.frames.frame import sample_material, sample_textures
from blysk.sim.frames.triangles import with_surface

__all__ = ["RECORD"]

_SIZE = 32, 24
_TEXTURE = TextureSampler(TexelMemory(104))
_SEED = 2026


def _constants(rng, renderer):
    """Frame constants of each material. Lights have any direction, and their frames any rotation."""
    design = renderer.design
    direction, halfway = (unit_codes(rng, design.lights) for _ in range(2))
    constants = []
    for index in range(design.materials):
        colors = rng.integers(0, 255 * 64, (2, design.lights, 3))
        ambient = rng.integers(0, 255 * 8, 3)
        constants.append(FrameConstants(9 + index, ambient, direction, halfway, *colors))
    if design.loads_tables:
        materials = [sample_material(design, index) for index in range(design.materials)]
        constants = with_tables(constants, materials, design)
    if renderer.rows:
        frames = np.linalg.qr(rng.normal(size=(design.lights - 1, 3, 3)))[0]
        axes = LightAdapter.codes_of(frames[:, : renderer.rows // len(frames)])
        constants[0] = replace(constants[0], axes=axes)
    return constants if design.albedo is None else sample_textures(design, constants, rng)


def _made(unit, case):
    model = unit.model
    constants = _constants(np.random.default_rng(_SEED), model)
    frame = {name: code for name, code in case.constants.items() if name != "picture"}
    return model.compute(Triangles(**case.beats), frame_of(frame), constants)


def _status(unit, case):
    made = _made(unit, case)
    return made.counts | {"out_of_range_spans": made.out_of_range_spans}


def _triangles(unit, rng, count, size=6.0, spread=0.2):
    """Overlapping triangles of all kinds in a small picture."""
    design = unit.model.design
    triangles = ended(random_triangles(rng, count, size=size, spread=spread))
    triangles = with_surface(triangles, unit.model.geometry.surface, rng)
    triangles.material[:] = rng.integers(0, design.materials, count)
    if unit.model.rows:
        # With several lights no normal may be longer than 1.
        triangles.normal[:] //= 2
    frame = FrameSettings.centred(*_SIZE, limit=FrameSettings.limit_of(15.0))
    write = writes_of(_constants(np.random.default_rng(_SEED), unit.model))
    codes = frame.codes | {"picture": 0}
    return Case(triangles.beats, {name: codes[name] for name in unit.constants.shape().members}, write)


def _tiny(unit, rng, count):
    """Triangles of about one pixel."""
    return _triangles(unit, rng, count, 1.0)


def _wide(unit, rng, count):
    """Triangles larger than the picture, with normals near to each other."""
    return _triangles(unit, rng, count, 400.0, 0.02)


def _variants():
    for name, options in (
        ("quotient", {}),
        ("quotient, compact", {"style": "compact"}),
        ("renormalise, 2 lights, 3 materials", {"method": "renormalise", "lights": 2, "materials": 3}),
        ("linear, coarse", {"method": "linear", "model": "cosquad"}),
        ("linear, compact", {"method": "linear", "model": "cosquad", "style": "compact"}),
        ("quotient, phong, coarse", {"model": "phong"}),
        ("quotient, phong, compact", {"model": "phong", "style": "compact"}),
        ("quotient, 2 lights", {"lights": 2}),
        ("quotient, 2 lanes", {}),
        ("quotient, phong, 2 lights, 2 lanes, coarse, 2 setups", {"model": "phong", "lights": 2}),
        ("quotient, no highlights, 2 lanes, compact geometry", {"model": None}),
        (
            "quotient, phong, 3 lights, compact, coarse",
            {"model": "phong", "style": "compact", "lights": 3, "materials": 2},
        ),
        ("quotient, 4 lights, no highlights", {"model": None, "lights": 4}),
        ("quotient, colours", {}),
        (
            "quotient, 2 lights, colours, textures, compact",
            {"lights": 2, "style": "compact", "materials": 2},
        ),
    ):
        design = preset(**{"x_bits": 5, "y_bits": 5} | options)
        if "colours" in name:
            design = replace(design, albedo=Albedo(texture=_TEXTURE if "textures" in name else None))
        coarse = CoarseDepth(*_SIZE) if "coarse" in name else None
        build = {"lanes": 2} if "2 lanes" in name else {}
        build |= {"setups": 2} if "2 setups" in name else {}
        build |= {"geometry_style": "compact"} if "compact geometry" in name else {}
        renderer = Renderer(design.built(top="render", coarse=coarse, **build))
        yield name, Variant(partial(RendererUnit, renderer, _SIZE), long=name != "quotient")


RECORD = Record(
    name="render",
    title="Triangles to pixels",
    source="[T] figure 4.10",
    variants=dict(_variants()),
    expect=lambda unit, case: _made(unit, case).beats,
    status=_status,
    stimuli={
        "triangles": Stimulus(_triangles, 200),
        "tiny": Stimulus(_tiny, 200),
        "wide": Stimulus(_wide, 120),
    },
    axis="",
    still={
        "a counter has room for more than a run has": "count_spans[9-31]",
        "the FIFO of depths has room whenever the pipeline takes a span": "depths_room[0] depths_level[5]",
        "fewer spans wait for shading than the FIFO has places": "spans_level[9]",
        "a line of the picture has fewer than 64 pixels": "{spans_payload,read,word}[16-21]",
    },
    remembers=True,
)
