"""Specialisation: the smallest pipeline that draws given scenes, and the reason for each reduction."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import PreparedFrame, prepare
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit

__all__ = ["Reduction", "Specialisation", "specialise"]


class Reduction(NamedTuple):
    """A part of a pipeline that its scenes do not need.

    Parameters
    ----------
    reason : str
        One line with the part, and the reason why the scenes do not need it.
    changes : dict
        New values of fields of `ShadingPipeline`. A field that is itself a record has a dict of its changed
        fields.
    """

    reason: str
    changes: dict[str, Any]


def _without(design: ShadingPipeline, reduction: Reduction) -> ShadingPipeline:
    changes = {
        name: replace(getattr(design, name), **value) if isinstance(value, dict) else value
        for name, value in reduction.changes.items()
    }
    return replace(design, **changes)


@dataclass(frozen=True)
class Specialisation:
    """The smallest pipeline for a scene or the frames of a turntable, and the full pipeline.

    Parameters
    ----------
    full : ShadingPipeline
        The pipeline with every part.
    reductions : tuple of Reduction
        The parts that the scenes do not need.
    scenes : tuple of Scene
        The scenes that `design` draws, without lights that have no effect, and with equal materials merged.
    """

    full: ShadingPipeline
    reductions: tuple[Reduction, ...]
    scenes: tuple[Scene, ...]

    @cached_property
    def design(self) -> ShadingPipeline:
        """The smallest pipeline."""
        return reduce(_without, self.reductions, self.full)

    def costs(self) -> tuple[Cost, tuple[Cost, ...]]:
        """Costs of the full pipeline: without reductions, with the first, with the first two, and so on."""
        designs = accumulate(self.reductions, _without, initial=self.full)
        costs = [cost_of(ShadingPipelineUnit(design)) for design in designs]
        return costs[0], tuple(costs[1:])


def specialise(
    scenes: Scene | Sequence[Scene], full: ShadingPipeline | None = None, *, exact: bool = True
) -> Specialisation:
    """The smallest pipeline for a scene, without the parts that the scene does not use.

    These parts are left out:

    - lights that light nothing;
    - the specular path, if no span has specular light;
    - the highlight gate, if there is nothing to gate;
    - the memory of materials, if all are equal;
    - the PROM, if there is one exponent;
    - two of three channels, if all colours are grey, and there is no albedo;
    - the upper bits of coordinates and lengths.

    The words of the arithmetic keep their widths, so that every pixel stays the same. Vectors of spans depend
    on all lights and on the highlights. A method with vectors of spans therefore keeps all lights and the
    highlights.

    If ``exact`` is false and all spans are short, the differences of ``chord-local`` also have fewer bits
    than in the full pipeline. The error bound stays, but pixels may change.

    Parameters
    ----------
    scenes : Scene or sequence of Scene
        One scene, or several that differ in the camera only.
    full : ShadingPipeline, optional
        Method and model, with as many lights and materials as the scene. By default `preset` gives them.
    exact : bool
        Whether the pixels must equal the pixels of the full pipeline to the bit.

    Raises
    ------
    ValueError
        If the scene has more lights or other materials than the full pipeline, or a term is brighter than 8.
    """
    scenes = (scenes,) if isinstance(scenes, Scene) else tuple(scenes)
    if full is None:
        lights, materials = max(len(scenes[0].lights), 1), len(scenes[0].materials)
        full = preset(lights=lights, materials=materials)
    scenes, unlit = _without_dark_lights(scenes, full, exact)
    scenes, merged = _without_equal_materials(scenes, full)
    reductions = [*unlit, *merged]
    design = Specialisation(full, tuple(reductions), scenes).design
    prepared = [prepare(scene, design) for scene in scenes]
    constants = prepared[0].constants
    if not (exact and design.interpolator.lights_share_words):
        reductions += _without_highlights(design, prepared, constants)
    reductions += _with_fixed_values(scenes[0], design, constants, reductions)
    longest = max(int(frame.spans.length.max(initial=0)) for frame in prepared)
    reductions += _with_fewer_bits(full, scenes[0], longest)
    if not exact and design.lights:
        reductions += _with_shorter_words(design, longest)
    return Specialisation(full, tuple(reductions), scenes)


def _constants(scene: Scene, lights: int | None, mirror: bool = False) -> list[FrameConstants]:
    return [
        FrameConstants.of(scene, lights, index=index, mirror=mirror) for index in range(len(scene.materials))
    ]


def _without_dark_lights(
    scenes: tuple[Scene, ...], full: ShadingPipeline, exact: bool
) -> tuple[tuple[Scene, ...], list[Reduction]]:
    constants = _constants(scenes[0], full.lights, full.mirror)
    bright = np.any([of.diffuse | of.specular for of in constants], axis=(0, 2))
    if full.interpolator.lights_cut and bright.any():
        # Every light that is on cuts spans, whether it lights a pixel or not.
        bright[: len(scenes[0].lights)] |= [light.is_on for light in scenes[0].lights]
    if bright.all() or (exact and full.interpolator.lights_share_words and bright.any()):
        return scenes, []
    count = int(np.count_nonzero(bright))
    kept = tuple(light for light, lit in zip(scenes[0].lights, bright, strict=False) if lit)
    place = np.cumsum(bright) - 1
    factors = tuple(int(place[index]) for index in full.factors if bright[index])
    scenes = tuple(replace(scene, lights=kept) for scene in scenes)
    if count:
        reason = f"{full.lights - count} of {full.lights} lights: they light nothing"
        return scenes, [Reduction(reason, {"lights": count, "factors": factors})]
    nothing = {"lights": 0, **_no_specular(full)}
    return scenes, [Reduction("no light path: no light lights anything", nothing)]


def _no_specular(design: ShadingPipeline) -> dict[str, Any]:
    """Changes that leave out the specular path and, with an albedo, its tints."""
    tints = {"albedo": {"tints": False}} if design.albedo is not None else {}
    return {"specular": None, "gate": False, "factors": (), **tints}


def _without_equal_materials(
    scenes: tuple[Scene, ...], full: ShadingPipeline
) -> tuple[tuple[Scene, ...], list[Reduction]]:
    keys = [
        (
            *of.writes()["data"].tolist(),
            full.highlight_parameter(material),
            material.two_sided,
            material.tinted,
            material.texture,
            # With an albedo the emission is not a part of the ambient colour.
            material.emission if scenes[0].has_albedo else None,
        )
        for of, material in zip(_constants(scenes[0], None, full.mirror), scenes[0].materials, strict=True)
    ]
    first: dict[tuple, int] = {}
    index = np.array([first.setdefault(key, len(first)) for key in keys])
    if len(first) >= full.materials:
        return scenes, []
    used = [scenes[0].materials[keys.index(key)] for key in first]
    scenes = tuple(
        replace(
            scene,
            mesh=replace(scene.mesh, material=index[scene.mesh.material]),
            material=used if len(used) > 1 else used[0],
        )
        for scene in scenes
    )
    what = "no memory of materials" if len(used) == 1 else "a smaller memory of materials"
    reason = f"{what}: {len(used)} of {full.materials} are distinct"
    return scenes, [Reduction(reason, {"materials": len(used)})]


def _without_highlights(
    design: ShadingPipeline, prepared: Sequence[PreparedFrame], constants: Sequence[FrameConstants]
) -> list[Reduction]:
    if design.specular is None or not design.lights:
        return []
    nothing = _no_specular(design)
    if not any(of.specular.any() for of in constants):
        return [Reduction("no specular path: every k_s is 0", nothing)]
    if not design.interpolator.serves_gate:
        return []
    lit = np.concatenate([design.lit_spans(frame.spans, constants) for frame in prepared])
    shown = np.array([of.specular.any(axis=-1) for of in constants])
    material = np.concatenate([frame.spans.material for frame in prepared])
    if not (lit & shown[material]).any():
        return [Reduction("no specular path: the gate proves that no span holds a highlight", nothing)]
    if design.gate and lit.all():
        return [Reduction("no highlight gate: every span may hold a highlight", {"gate": False})]
    return []


def _with_fixed_values(
    scene: Scene,
    design: ShadingPipeline,
    constants: Sequence[FrameConstants],
    reductions: Sequence[Reduction],
) -> list[Reduction]:
    """Reductions by fixed values: exponent or tables (only with specular light), and grey colours."""
    found = []
    exponents = {of.exponent for of in constants}
    has_specular = all(reduction.changes.get("specular", 0) is not None for reduction in reductions)
    if has_specular and design.loads_tables:
        if design.specular.fixed is None:
            tables = {of.bank: of.lobe.parameter for of in constants}
            fixed = tuple(tables[bank] for bank in sorted(tables))
            reason = f"{len(fixed)} of {design.specular.banks} tables, fixed at build time: no writes"
            found.append(Reduction(reason, {"specular": {"fixed": fixed, "banks": len(fixed)}}))
    elif len(exponents) == 1 and has_specular:
        (exponent,) = exponents
        reason = f"exponent fixed at {exponent}: PROM folded"
        found.append(Reduction(reason, {"build": {"exponent": exponent}}))
    colors = [np.reshape(x, (-1, 3)) for of in constants for x in (of.ambient, of.diffuse, of.specular)]
    if not scene.has_albedo and np.all(np.ptp(np.concatenate(colors), axis=1) == 0):
        found.append(Reduction("one channel of three: every colour is grey", {"grey": True}))
    return found


def _with_fewer_bits(full: ShadingPipeline, scene: Scene, longest: int) -> list[Reduction]:
    """Reductions of words: coordinates to the picture's size, lengths to the longest span."""
    found = []
    for name, side, what in (("x_bits", scene.width, "columns"), ("y_bits", scene.height, "rows")):
        bits = max(int(side - 1).bit_length(), 1)
        if bits < getattr(full, name):
            found.append(Reduction(f"{name[0]} in {bits} bits: {side} {what}", {name: bits}))
    bits = max(longest.bit_length(), 2)
    if bits < full.length_bits:
        reason = f"length in {bits} bits: the longest span has {longest} pixels"
        found.append(Reduction(reason, {"length_bits": bits}))
    return found


def _with_shorter_words(design: ShadingPipeline, longest: int) -> list[Reduction]:
    """Reduction of the differences of ``chord-local`` to the fraction bits that the longest span needs."""
    method = design.interpolator
    bits = method.shortest_words(longest)
    if bits is None:
        return []
    most = max(method.word_choices)
    reason = f"differences of {bits} in place of {most} fraction bits: the longest span has {longest} pixels"
    return [Reduction(reason, {"interpolator": {"fraction_bits": bits}})]
