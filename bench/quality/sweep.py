"""A method's error at every exponent: frames of meshes by the bit-accurate model and in float64.

``python -m blysk.bench.quality.sweep [MESH ...]`` takes each mesh (the teapot by default) at 320x240, in
white light and with a grey, glossy material, by the method quotient at every exponent from 1 to 1000 with the
model blinn and at 30 of them with phong; by another method at every exponent with cosquad and at 30 with
every other model. Each frame is computed by `ShadingPipeline.compute`, which the simulated pipeline
equals to the bit (``python -m blysk.bench.quality.pairs`` and the tests of `pipeline`), and compared with
exact normals at every pixel and the same model. ``--json`` keeps the figures of every frame. The exit status
is 1 if the error of a pixel is over 1 LSB, switched pixels left out (see `Point`); 2 for a mesh that
cannot be read.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.prepare import constants_of, spans_for
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material, halfway_vector, intensity_of_cosines, saturate
from blysk.golden.reference.raster import Raster, fragment_normals, rasterise
from blysk.golden.reference.scene import Scene
from blysk.sim.errors import InputError
from blysk.sim.meshes.mesh import load_mesh

__all__ = ["EXPONENTS", "FEW_EXPONENTS", "LARGEST", "LARGEST_COSINE", "Point", "Summary", "SweptMesh", "main"]
__all__ += ["models_of", "summarise"]

EXPONENTS = tuple(range(1, MAX_EXPONENT + 1))

FEW_EXPONENTS = (1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 29, 38, 50, 65, 85, 100, 130, 170, 220, 270, 330, 400)
FEW_EXPONENTS += (470, 500, 600, 700, 800, 900, 1000)
"""Exponents of the models that are not swept at every exponent."""

LARGEST = 1.0
"""Target: the largest error of a channel, in LSB."""

LARGEST_COSINE = LocalChordInterpolator.DIFFUSE_BUDGET / 255 + 2.0**-15
"""Largest ``|N·L|``, 5e-4, whose sign a method may change: the error of the fit of ``chord-local``, and
errors of vectors and words; of ``quotient`` less."""


def models_of(method: str) -> tuple[str, ...]:
    """Models that are swept with a method: of ``quotient`` those whose table has no end at a right angle."""
    return (model_of(method), *MIRROR_LOBES) if METHODS[method].needs_table else tuple(MODELS)


@dataclass(frozen=True)
class Point:
    """Errors of a frame.

    A light with ``N . L <= 0`` gives nothing, and at small exponents a highlight may reach such pixels. If
    the exact N·L is so close to 0 that the method's error decides its sign, the whole highlight is on in one
    frame and off in the other. A pixel is *switched* if its error is over `LARGEST`, the signs differ, and
    the exact N·L is within `LARGEST_COSINE`; switched pixels are counted apart.

    Parameters
    ----------
    model : str
        Reflection model.
    exponent : int
        Exponent of the highlight.
    spans : int
        Spans after the cutting.
    pixels : int
        Pixels that show the surface.
    max_lsb : float
        Largest error of a channel of those pixels, in LSB.
    over : int
        Pixels with an error over `LARGEST`.
    switched : int
        Number of switched pixels among them.
    switched_cosine : float
        Largest exact ``|N . L|`` of switched pixels, 0 without any.
    steady_lsb : float
        Largest error of the pixels that are not switched, in LSB.
    """

    model: str
    exponent: int
    spans: int
    pixels: int
    max_lsb: float
    over: int
    switched: int
    switched_cosine: float
    steady_lsb: float


class SweptMesh:
    """A picture of a mesh with one directional light, rasterised once for every exponent and model.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    width, height : int
        Size of the picture.
    coefficients : three floats, optional
        k_a, k_d and k_s of every channel; by default those of `scene_for`.
    view, light : three floats each, optional
        Directions from the mesh to the viewer and to the light; by default those of `scene_for`.
    """

    def __init__(
        self,
        mesh: Mesh,
        width: int = 320,
        height: int = 240,
        coefficients: Sequence[float] | None = None,
        view: Sequence[float] | None = None,
        light: Sequence[float] | None = None,
    ):
        scene = scene_for(mesh, 1, width, height)
        if coefficients is not None:
            scene = replace(scene, material=Material(*((k,) * 3 for k in coefficients), 1))
        if view is not None:
            camera = Camera.framing(mesh.vertices, view, scene.camera.projection, width / height)
            scene = replace(scene, camera=camera)
        self.scene = scene if light is None else replace(scene, lights=(Light(tuple(light)),))
        self.raster = raster = rasterise(self.scene)
        self._shown = np.flatnonzero(raster.visible)
        normals = fragment_normals(self.scene, raster, self._shown)
        (light,) = self.scene.lights
        halfway = halfway_vector(light.direction, self.scene.camera.viewer)
        self._cosine = normals @ np.asarray(light.direction)
        self._highlight = normals @ halfway
        viewer = self.scene.camera.viewer
        self._mirrored = 2 * self._cosine * (normals @ viewer) - light.direction @ viewer

    @property
    def pixels(self) -> int:
        """Pixels that show the surface."""
        return len(self._shown)

    def scene_of(self, exponent: int) -> Scene:
        """The scene at an exponent."""
        return replace(self.scene, material=replace(self.scene.material, exponent=exponent))

    def golden(self, model: str, exponent: int) -> np.ndarray:
        """Frame with exact normals at every pixel, in LSB: float64 array, shape (pixels, 3).

        These are the colours of the golden renderer's `render`, in the order of the fragments.
        """
        scene, reflection = self.scene_of(exponent), (MODELS | LOBES | MIRROR_LOBES)[model].reflection
        highlight = self._mirrored if reflection.MIRROR else self._highlight
        shaded = intensity_of_cosines(
            scene.material,
            scene.lights,
            scene.ambient_light,
            self._cosine[:, np.newaxis],
            highlight[:, np.newaxis],
            reflection,
        )
        return 255 * saturate(shaded)

    def spans_of(self, design: ShadingPipeline, exponent: int) -> tuple[Raster, Spans]:
        """Spans as `prepare` cuts and quantises them for a pipeline."""
        scene = self.scene_of(exponent)
        cut, _ = cut_spans(scene, self.raster, design)
        return cut, spans_for(scene, cut, design)

    def points(self, exponent: int, models: Iterable[str], method: str = "quotient") -> Iterator[Point]:
        """Errors of the frames at an exponent.

        Parameters
        ----------
        exponent : int
            1 to 1000.
        models : iterable of str
            Reflection models of `models_of`, one frame each.
        method : str
            Method of interpolation.
        """
        cut, spans = self.spans_of(preset(method, model_of(method)), exponent)
        for model in models:
            design = preset(method, model)
            if design.mirror:
                cut, spans = self.spans_of(design, exponent)
            (constants,) = constants_of(self.scene_of(exponent), design)
            color = design.compute(spans, constants).color[self._shown]
            error = np.abs(color - self.golden(model, exponent)).max(axis=1, initial=0)
            over = np.flatnonzero(error > LARGEST)
            switched = over[self._switched(design, cut, spans, constants, over)]
            steady = error.copy()
            steady[switched] = 0
            yield Point(
                model,
                exponent,
                len(spans),
                self.pixels,
                float(error.max(initial=0)),
                len(over),
                len(switched),
                float(np.abs(self._cosine[switched]).max(initial=0)),
                float(steady.max(initial=0)),
            )

    def _switched(
        self,
        design: ShadingPipeline,
        cut: Raster,
        spans: Spans,
        constants: FrameConstants,
        chosen: np.ndarray,
    ) -> np.ndarray:
        """Whether each of the ``chosen`` shown pixels is switched."""
        fragment = self._shown[chosen]
        which, place = np.unique(cut.span[fragment], return_inverse=True)
        length = spans.length[which]
        cosine = design.operands(spans[which], constants).cosine.codes[:, 0]
        start = np.cumsum(length) - length
        of_model = cosine[start[place] + cut.offset[fragment]]
        exact = self._cosine[chosen]
        return ((of_model > 0) != (exact > 0)) & (np.abs(exact) < LARGEST_COSINE)


@dataclass(frozen=True)
class Summary:
    """The largest errors of a mesh and a model over all exponents.

    Parameters
    ----------
    mesh, model : str
        Names.
    exponents, pixels : int
        Number of frames, and of pixels of each.
    steady_lsb, steady_exponent
        Largest error without switched pixels, in LSB, and its exponent; see `Point`.
    over : int
        Pixels over `LARGEST` of all frames, switched ones left out.
    max_lsb, exponent
        The same with switched pixels.
    switched : int
        Switched pixels over `LARGEST` of all frames.
    switched_cosine : float
        Largest exact ``|N . L|`` of switched pixels.
    missed : tuple of int
        Exponents at which a pixel that is not switched has an error over `LARGEST`.
    """

    mesh: str
    model: str
    exponents: int
    pixels: int
    steady_lsb: float
    steady_exponent: int
    over: int
    max_lsb: float
    exponent: int
    switched: int
    switched_cosine: float
    missed: tuple[int, ...]


def summarise(mesh: str, points: Sequence[Point]) -> list[Summary]:
    """A summary for each model, in the order of their first points."""
    result = []
    for model in dict.fromkeys(point.model for point in points):
        own = [point for point in points if point.model == model]
        steady = max(own, key=lambda point: point.steady_lsb)
        largest = max(own, key=lambda point: point.max_lsb)
        result.append(
            Summary(
                mesh,
                model,
                len(own),
                own[0].pixels,
                steady.steady_lsb,
                steady.exponent,
                sum(point.over - point.switched for point in own),
                largest.max_lsb,
                largest.exponent,
                sum(point.switched for point in own),
                max(point.switched_cosine for point in own),
                tuple(point.exponent for point in own if point.steady_lsb > LARGEST),
            )
        )
    return result


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each mesh and model, and compare with the target.

    Returns
    -------
    int
        0; 1 when a steady pixel is over `LARGEST`, 2 when a mesh cannot be read.
    """
    parser = argparse.ArgumentParser(prog="blysk.bench.quality.sweep", description="error at every exponent")
    parser.add_argument("meshes", nargs="*", default=["teapot"])
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--height", type=int, default=240)
    parser.add_argument("--method", choices=METHODS, default="quotient")
    parser.add_argument("--models", nargs="+", choices=(*LOBES, *MIRROR_LOBES, *MODELS), metavar="MODEL")
    parser.add_argument("--exponents", nargs="+", type=int, help="those of every model")
    for name, meaning in (
        ("coefficients", "k_a, k_d and k_s of every channel"),
        ("view", "direction to the viewer"),
        ("light", "direction to the light"),
    ):
        parser.add_argument(f"--{name}", nargs=3, type=float, help=meaning)
    parser.add_argument("--json", help="file for the figures of every frame")
    options = parser.parse_args(arguments)
    served = models_of(options.method)
    models = options.models or served
    try:
        for model in models:
            if model not in served:
                raise InputError(
                    f"--models {model}", f"is not swept with {options.method}", f"use {', '.join(served)}"
                )
        loaded = [load_mesh(source, materials=False) for source in options.meshes]
    except InputError as error:
        print(f"blysk.bench.quality.sweep: {error}", file=sys.stderr)
        return 2
    whole, few = (set(options.exponents or default) for default in (EXPONENTS, FEW_EXPONENTS))
    print(
        "| mesh | model | exponents | pixels a frame | largest error, LSB | at n | pixels over 1 LSB "
        "| with switched pixels | at n | switched over 1 LSB | their largest N.L |"
    )
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    figures, summaries = {}, []
    for one in loaded:
        frame = SweptMesh(
            one.mesh, options.width, options.height, options.coefficients, options.view, options.light
        )
        points = [
            point
            for exponent in sorted(whole | few)
            for point in frame.points(
                exponent,
                [m for m in models if exponent in (whole if m == model_of(options.method) else few)],
                options.method,
            )
        ]
        figures[one.name] = [asdict(point) for point in points]
        for row in sorted(summarise(one.name, points), key=lambda row: models.index(row.model)):
            summaries.append(row)
            print(
                f"| {row.mesh} | {row.model} | {row.exponents} | {row.pixels:,} | {row.steady_lsb:.3f} "
                f"| {row.steady_exponent} | {row.over} | {row.max_lsb:.2f} | {row.exponent} "
                f"| {row.switched} | {row.switched_cosine:.1e} |",
                flush=True,
            )
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(figures, file)
    missed = [row for row in summaries if row.missed]
    for row in missed:
        print(
            f"missed: {row.steady_lsb:.3f} LSB: {row.mesh}, {row.model}; at {len(row.missed)} exponents: "
            f"{', '.join(map(str, row.missed))}",
            file=sys.stderr,
        )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
