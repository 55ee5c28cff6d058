"""Every method with every reflection model: simulated pixels against those of the bit-accurate model.

``python -m blysk.bench.quality.pairs [MESH ...]`` renders each mesh (the teapot by default) at 96x72 and
exponents 1, 30 and 1000 with each pair, also without specular light, in the compiled engine, and compares
every output pixel, hidden ones too, with `ShadingPipeline.compute`. It prints a line for each pair. A table
of the method quotient ends at a right angle: an exponent at which a model lives on beyond is left out, and
counted. The exit status is 1 if a pixel differs or a pair cannot be built, 2 for a mesh that cannot be read.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.golden.frames.prepare import constants_of, prepare
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS, PUBLISHED, preset
from blysk.golden.reference.geometry import Mesh
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.errors import InputError
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.mesh import load_mesh

__all__ = ["EXPONENTS", "Pair", "main", "measure", "mismatches", "models_of"]

EXPONENTS = (1, 30, 1000)

_ALL_MODELS = ("blinn", *MIRROR_LOBES, *MODELS)


@dataclass(frozen=True)
class Pair:
    """A method and a model, and the comparison of their frames.

    Parameters
    ----------
    method : str
        Method of interpolation.
    model : str or None
        Reflection model; ``None``: no specular light.
    frames, pixels : int
        Numbers of compared frames and pixels.
    mismatches : int
        Pixels that differ from the bit-accurate model's in coordinates, colour or mark of a span's end.
    failure : str
        One line that says why frames are missing; empty if none are.
    refused : tuple of int
        Exponents that the method does not serve with the model.
    """

    method: str
    model: str | None
    frames: int
    pixels: int
    mismatches: int
    failure: str = ""
    refused: tuple[int, ...] = ()


def models_of(method: str, models: Sequence[str | None]) -> list[str | None]:
    """Those of some models that a method serves, in order: of R·V only ``quotient`` does."""
    mirror = (METHODS | PUBLISHED)[method].serves_mirror
    return [model for model in models if mirror or model not in MIRROR_LOBES]


def _refuses(design: ShadingPipeline, exponent: int) -> bool:
    """Whether a design has no table of its model at an exponent."""
    if not design.loads_tables:
        return False
    try:
        design.lobe.table(exponent)
    except ValueError:
        return True
    return False


def mismatches(
    unit: ShadingPipelineUnit, mesh: Mesh, exponent: int, width: int, height: int
) -> tuple[int, int]:
    """Number of pixels of a frame, and of simulated pixels that differ from the bit-accurate model's.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        Pipeline of one light and one material.
    mesh : Mesh
        The surface.
    exponent : int
        Exponent of the highlight.
    width, height : int
        Size of the picture.

    Raises
    ------
    SimulationError
        If the pipeline breaks the stream's rules, stops, or gives another number of pixels.
    """
    scene = scene_for(mesh, exponent, width, height)
    spans = prepare(scene, unit.model).spans
    (constants,) = constants_of(scene, unit.model)
    expected = unit.model.compute(spans, constants)
    run = simulate(
        unit,
        beats_of(unit, spans),
        count=len(expected.x),
        write=constants.writes(),
    )
    wrong = (run.beats["x"] != expected.x) | (run.beats["y"] != expected.y)
    wrong |= run.beats["last"] != expected.last
    for channel, name in enumerate("rgb"):
        wrong |= run.beats[name] != expected.color[:, channel]
    # A flag that differs is one more: no pixel would show it.
    flags = int(run.status["out_of_range_spans"]) != expected.out_of_range_spans
    return len(wrong), int(np.count_nonzero(wrong)) + flags


def measure(
    meshes: Sequence[Mesh],
    methods: Sequence[str] = tuple(METHODS),
    models: Sequence[str | None] = (*_ALL_MODELS, None),
    exponents: Sequence[int] = EXPONENTS,
    width: int = 96,
    height: int = 72,
) -> Iterator[Pair]:
    """Compare the frames of every method with every model.

    Parameters
    ----------
    meshes : sequence of Mesh
        The meshes.
    methods, models : sequences
        Methods and models of the pairs.
    exponents : sequence of int
        Exponents, with a frame of each mesh for each.
    width, height : int
        Size of a frame.
    """
    for method in methods:
        for model in models_of(method, models):
            frames = pixels = wrong = 0
            failure, refused = "", ()
            try:
                design = preset(method, model)
                refused = tuple(exponent for exponent in exponents if _refuses(design, exponent))
                unit = ShadingPipelineUnit(design)
                for mesh in meshes:
                    for exponent in exponents:
                        if exponent in refused:
                            continue
                        of_frame = mismatches(unit, mesh, exponent, width, height)
                        frames, pixels, wrong = frames + 1, pixels + of_frame[0], wrong + of_frame[1]
            except (ValueError, SimulationError) as error:
                failure = f"{type(error).__name__}: {error}".splitlines()[0]
            yield Pair(method, model, frames, pixels, wrong, failure, refused)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each pair; the exit status.

    Returns
    -------
    int
        0; 1 when a pixel differs or a frame is missing, 2 when a mesh cannot be read.
    """
    parser = argparse.ArgumentParser(
        prog="blysk.bench.quality.pairs", description="every method with every model"
    )
    parser.add_argument("meshes", nargs="*", default=["teapot"])
    parser.add_argument("--width", type=int, default=96)
    parser.add_argument("--height", type=int, default=72)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=tuple(METHODS))
    parser.add_argument(
        "--models", nargs="+", choices=(*LOBES, *_ALL_MODELS[1:], "none"), default=(*_ALL_MODELS, "none")
    )
    parser.add_argument("--exponents", nargs="+", type=int, default=EXPONENTS)
    parser.add_argument("--json", help="file for the same figures")
    options = parser.parse_args(arguments)
    try:
        meshes = [load_mesh(source, materials=False).mesh for source in options.meshes]
    except InputError as error:
        print(f"blysk.bench.quality.pairs: {error}", file=sys.stderr)
        return 2
    models = [None if model == "none" else model for model in options.models]
    pairs = []
    print("| method | model | frames | pixels | mismatches |")
    print("|---|---|---:|---:|---:|")
    for pair in measure(meshes, options.methods, models, options.exponents, options.width, options.height):
        pairs.append(pair)
        note = f" {pair.failure} |" if pair.failure else ""
        note += f" not at exponent {', '.join(map(str, pair.refused))} |" if pair.refused else ""
        print(
            f"| {pair.method} | {pair.model or 'none'} | {pair.frames} | {pair.pixels:,} "
            f"| {pair.mismatches:,} |{note}",
            flush=True,
        )
    pixels, wrong = (sum(getattr(pair, name) for pair in pairs) for name in ("pixels", "mismatches"))
    failed = sum(bool(pair.failure) for pair in pairs)
    refused = sum(len(pair.refused) for pair in pairs)
    print(
        f"\n{len(pairs)} pairs, {len(meshes)} meshes, {pixels:,} pixels: {wrong:,} mismatches, "
        f"{failed} pairs with frames missing, {refused} exponents that are not served"
    )
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump([asdict(pair) for pair in pairs], file)
    return 1 if wrong or failed else 0


if __name__ == "__main__":
    sys.exit(main())
