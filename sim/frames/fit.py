"""Only what a scene needs: the smallest pipeline that draws it, and why it does (pipeline.md)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.number.unit_vector import values
from blysk.golden.pipeline import Design
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import prepare

__all__ = ["Fit", "Omission", "for_scene"]


class Omission(NamedTuple):
    """Something that a scene does not need.

    Parameters
    ----------
    reason : str
        What is left out, and why: one line.
    changes : dict
        Fields of `Design` without it; of a field that is itself a record, those of its fields.
    """

    reason: str
    changes: dict[str, object]


def _without(design: Design, omission: Omission) -> Design:
    changes = {
        name: replace(getattr(design, name), **value) if isinstance(value, dict) else value
        for name, value in omission.changes.items()
    }
    return replace(design, **changes)


@dataclass(frozen=True)
class Fit:
    """A pipeline for a scene, or for the frames of a turntable, beside the full one.

    Parameters
    ----------
    full : Design
        What has everything.
    omissions : tuple of Omission
        What the scene does not need.
    scenes : tuple of Scene
        The scenes, without lights that give none and with equal materials merged: what `design` draws.
    """

    full: Design
    omissions: tuple[Omission, ...]
    scenes: tuple[Scene, ...]

    @cached_property
    def design(self) -> Design:
        """The smallest pipeline."""
        return reduce(_without, self.omissions, self.full)

    def costs(self) -> tuple[Cost, tuple[Cost, ...]]:
        """Cost of the full pipeline, and of that without the first omission, the first two, and so on."""
        designs = accumulate(self.omissions, _without, initial=self.full)
        costs = [cost_of(ShadingPipelineUnit(design)) for design in designs]
        return costs[0], tuple(costs[1:])


def for_scene(scenes: Scene | Sequence[Scene], full: Design | None = None, *, exact: bool = True) -> Fit:
    """The smallest pipeline for a scene, of which every part is used.

    Left out are: lights that light nothing; the specular path, where no span has specular light; the
    highlight gate, where there is nothing to gate; the memory of materials, for equal ones; the PROM, for one
    exponent; two of three channels, where all colours are grey; and the upper bits of coordinates and
    lengths. No word of the arithmetic changes its width, so that no pixel does. If not ``exact``, the chord
    method also has fewer terms in its polynomial where all spans are narrow, and fewer bits in its
    differences where all are short: its error bound stays, its pixels may change.

    Parameters
    ----------
    scenes : Scene or sequence of Scene
        What it is to draw: one scene, or several that differ in the camera.
    full : Design, optional
        Method and model, with as many lights and materials as the scene. By default, the chord method with a
        highlight gate.
    exact : bool
        Whether the pixels must be those of the full pipeline to the bit.

    Raises
    ------
    ValueError
        If the scene has more lights or other materials than the full pipeline, or a term is brighter than 8.
    """
    scenes = (scenes,) if isinstance(scenes, Scene) else tuple(scenes)
    first = scenes[0]
    if full is None:
        full = preset("chord", lights=max(len(first.lights), 1), materials=len(first.materials), gate=True)
    omissions = []

    constants = [FrameConstants.of(first, full.lights, index=k) for k in range(len(first.materials))]
    bright = np.any([of.diffuse | of.specular for of in constants], axis=(0, 2))
    # With values, spans are cut by every light's, dark or not.
    if not bright.all() and not (full.takes_values and bright.any()):
        count = int(np.count_nonzero(bright))
        kept = tuple(light for light, lit in zip(first.lights, bright, strict=False) if lit)
        scenes = tuple(replace(scene, lights=kept) for scene in scenes)
        changes = {"lights": count} if count else {"lights": 0, "specular": None, "gate": False}
        reason = f"{full.lights - count} of {full.lights} lights: they light nothing"
        omissions.append(Omission(reason if count else "no light path: no light lights anything", changes))

    merged, index = _merge([FrameConstants.of(scenes[0], index=k) for k in range(len(first.materials))])
    if len(merged) < full.materials:
        used = [scenes[0].materials[k] for k in merged]
        scenes = tuple(
            replace(
                scene,
                mesh=replace(scene.mesh, material=index[scene.mesh.material]),
                material=used if len(used) > 1 else used[0],
            )
            for scene in scenes
        )
        what = "no memory of materials" if len(merged) == 1 else "a smaller memory of materials"
        reason = f"{what}: {len(merged)} of {full.materials} differ"
        omissions.append(Omission(reason, {"materials": len(merged)}))

    design = Fit(full, tuple(omissions), scenes).design
    constants = [FrameConstants.of(scenes[0], design.lights, index=k) for k in range(design.materials)]
    prepared = [prepare(scene, design) for scene in scenes]
    if design.lights:
        omissions += _without_highlights(design, prepared, constants)
    exponents = {of.exponent for of in constants}
    if len(exponents) == 1 and not any(omission.changes.get("specular", 0) is None for omission in omissions):
        (exponent,) = exponents
        omissions.append(
            Omission(f"exponent fixed at {exponent}: PROM folded", {"build": {"exponent": exponent}})
        )
    colors = [np.reshape(x, (-1, 3)) for of in constants for x in (of.ambient, of.diffuse, of.specular)]
    if np.all(np.ptp(np.concatenate(colors), axis=1) == 0):
        omissions.append(Omission("one channel of three: every colour is grey", {"grey": True}))
    for name, side, what in (("x_bits", first.width, "columns"), ("y_bits", first.height, "rows")):
        bits = max(int(side - 1).bit_length(), 1)
        if bits < getattr(full, name):
            omissions.append(Omission(f"{name[0]} in {bits} bits: {side} {what}", {name: bits}))
    longest = max(int(frame.spans.length.max(initial=0)) for frame in prepared)
    bits = max(longest.bit_length(), 2)
    if bits < full.length_bits:
        reason = f"length in {bits} bits: the longest span has {longest} pixels"
        omissions.append(Omission(reason, {"length_bits": bits}))
    if not exact and design.method == "chord" and design.lights:
        omissions += _shorter_words(prepared, longest)
    return Fit(full, tuple(omissions), scenes)


def _merge(constants: Sequence[FrameConstants]) -> tuple[list[int], np.ndarray]:
    """The first of each set of equal materials, and the new index of each material."""
    keys = [tuple(of.writes()["data"].tolist()) for of in constants]
    first: dict[tuple, int] = {}
    index = np.array([first.setdefault(key, len(first)) for key in keys])
    return [keys.index(key) for key in first], index


def _shorter_words(prepared: Sequence, longest: int) -> list[Omission]:
    """What narrow and short spans allow the chord method."""
    omissions = []
    left, right = (
        values(np.concatenate([getattr(frame.spans, name) for frame in prepared]))
        for name in ("normal_left", "normal_right")
    )
    half = np.linalg.norm(left - right, axis=-1).max(initial=0) / 2
    angle = float(np.degrees(2 * np.arcsin(min(half, 1.0))))
    # A code may be off by some thousandths of a degree.
    terms = [terms for terms, widest in ChordSetup.ANGLES.items() if angle < widest - 0.01]
    if terms and min(terms) < 3:
        reason = f"polynomial of {min(terms)} in place of 3 terms: the widest span has {angle:.2f} degrees"
        omissions.append(Omission(reason, {"interpolator": {"terms": min(terms)}}))
    bits = min(bits for bits in range(36, 47, 2) if longest <= ChordSetup(fraction_bits=bits).longest)
    if bits < 46:
        reason = f"differences of {bits} in place of 46 fraction bits: the longest span has {longest} pixels"
        omissions.append(Omission(reason, {"interpolator": {"fraction_bits": bits}}))
    return omissions


def _without_highlights(design: Design, prepared: Sequence, constants: Sequence) -> list[Omission]:
    """What the spans' highlights allow."""
    if design.specular is None:
        return []
    nothing = {"specular": None, "gate": False}
    if not any(of.specular.any() for of in constants):
        return [Omission("no specular path: every k_s is 0", nothing)]
    if not design.interpolator.serves_gate:
        return []
    lit = np.concatenate([design.lit_spans(frame.spans, constants) for frame in prepared])
    shown = np.array([of.specular.any(axis=-1) for of in constants])
    material = np.concatenate([frame.spans.material for frame in prepared])
    if not (lit & shown[material]).any():
        return [Omission("no specular path: the gate proves that no span holds a highlight", nothing)]
    if design.gate and lit.all():
        return [Omission("no highlight gate: every span may hold a highlight", {"gate": False})]
    return []
