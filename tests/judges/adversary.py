"""An adversary: a search that climbs to the inputs on which a method errs most.

A state of the search is a frame with a triangle in each of some cells. A round changes either all triangles a
little, and keeps those whose error grew, or what the triangles share: light, exponent or roughness, number of
columns, projection. W goes up to 1:10,000 within a triangle, and normals are up to 150 degrees apart. The
search climbs by the error of the light before a pixel is rounded, because rounding hides small changes.
"""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.frames.border import border_mask
from blysk.golden.frames.error_bound import error_bound
from blysk.golden.frames.frame import Picture, model_frame
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene

APART = 150.0
"""Largest angle between two normals of a triangle, in degrees."""
DEEPEST = 4.0
"""Decimal logarithm of the largest ratio of W."""
WIDEST = 4095


@dataclass(frozen=True)
class State:
    """A frame of the search, and the largest error of each triangle."""

    light: np.ndarray
    parameter: float
    """Exponent, or roughness of the models that have it."""
    columns: int
    perspective: bool
    places: np.ndarray
    """Corners, 0 to 1 across the cell and down, shape (T, 3, 2)."""
    depths: np.ndarray
    """Decimal logarithms of W, shape (T, 3)."""
    normals: np.ndarray
    errors: np.ndarray
    """Largest error of each triangle before rounding, in LSB, away from borders."""

    @property
    def largest(self) -> float:
        return float(self.errors.max())

    def __str__(self):
        worst, projection = self.errors.argmax(), "perspective" if self.perspective else "orthographic"
        triangle = self.places[worst].tolist(), self.depths[worst].tolist(), self.normals[worst].tolist()
        return (
            f"{self.largest:.3f} LSB: {projection}, {self.columns} columns, parameter {self.parameter:.4g}, "
            f"light {self.light.tolist()}, places, log W and normals {triangle}"
        )


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def apart(normals):
    """Triangles with two normals that are too far apart."""
    pairs = np.einsum("tik,tjk->tij", normals, normals)
    return (pairs < np.cos(np.radians(APART))).any(axis=(1, 2))


DIFFUSE, SPECULAR = 0.02, 0.98


def light_of(design: ShadingPipeline, frame: Picture) -> np.ndarray:
    """Light of each pixel of a frame in LSB before it is rounded, shape (rows * columns,)."""
    prepared, cut = frame.prepared, frame.cut_raster
    (constants,) = prepared.constants
    operands = design.operands(prepared.spans, constants)
    unit = Diffuse(operands.cosine.format)
    dark = unit.dark(operands.cosine)
    term = design.specular.compute(operands.highlight, dark, constants.highlight).values[:, 0]
    light = 255 * (DIFFUSE * unit.compute(operands.cosine).values[:, 0] + SPECULAR * term)
    found = np.zeros(frame.image.shape[0] * frame.image.shape[1])
    found[cut.pixel[cut.visible]] = light[cut.visible]
    return found


class Adversary:
    """A search against a method and a model, from a seed."""

    def __init__(self, method: str, model: str, seed: int, count: int = 12):
        self.method, self.model, self.count = method, model, count
        self.rng = np.random.default_rng([seed, *f"{method} {model}".encode()])
        self.rough = model in ("ggx", "beckmann")
        # Sharper lobes have no bound of a frame, or a large bound.
        roughest = 0.05 if method == "chord-local" else 0.2
        self.range = (roughest, 1.0) if self.rough else (1.0, 1000.0)
        self.largest_pixel = 0.0
        """Largest error of a rounded pixel in the whole search, in LSB."""
        self.excess, self.worst = -np.inf, "no frame has a bound"
        """By how much an error was nearest to the bound of its frame, or over it, in LSB; and this state."""

    def scene(self, state: State) -> Scene:
        """White light on a surface with a strong highlight."""
        columns, count = state.columns, len(state.places)
        rows = int(np.clip(12_000 // columns, 5, 24))
        height = rows * count
        places = state.places * (columns - 4, rows - 4) + 2
        places = places + np.stack([np.zeros(count), rows * np.arange(count)], axis=1)[:, np.newaxis]
        w = 10**state.depths
        scale = 2 * np.tan(np.radians(20)) / height
        across = (
            (places - (columns / 2, height / 2)) * scale * (w[..., np.newaxis] if state.perspective else 1)
        )
        vertices = np.concatenate([across * (1, -1), -w[..., np.newaxis]], axis=-1).reshape(-1, 3)
        mesh = Mesh(vertices, np.arange(3 * count).reshape(-1, 3), state.normals.reshape(-1, 3))
        if state.perspective:
            looks = {"projection": "perspective", "field_of_view": 40}
        else:
            looks = {"projection": "orthographic", "height": scale * height}
        camera = Camera((0, 0, 0), (0, 0, -1), near=1e-9, **looks)
        material = Material((0,) * 3, (DIFFUSE,) * 3, (SPECULAR,) * 3, 1)
        if self.rough:
            material = replace(material, roughness=state.parameter)
        else:
            material = replace(material, exponent=round(state.parameter))
        return Scene(mesh, camera, columns, height, material, (Light(tuple(state.light)),))

    def judged(self, state: State) -> State:
        """The state with its errors. Rounding may add half an LSB to the error of the light."""
        scene = self.scene(state)
        design = preset(self.method, self.model).for_materials(scene.materials)
        frame = model_frame(scene, design)
        raster, reflection = frame.raster, design.specular.reflection
        exact = 255 * render(scene, "phong", reflection, raster).image
        exact, image = (of[..., 0].reshape(-1) for of in (exact, frame.image))
        steady = ~border_mask(scene, raster, reflection).reshape(-1)
        pixel = float((np.abs(image - exact) * steady).max())
        self.largest_pixel = max(self.largest_pixel, pixel)
        shown = np.flatnonzero(raster.visible)
        error, errors = np.abs(light_of(design, frame) - exact) * steady, np.zeros(len(state.places))
        np.maximum.at(errors, raster.triangle[raster.span[shown]], error[raster.pixel[shown]])
        state, bound = replace(state, errors=errors), error_bound(scene, design, frame.cut_raster)
        if bound is not None:
            assert frame.out_of_range_spans == 0, str(state)
            excess = max(pixel, 0.5 + state.largest) - bound
            if excess > self.excess:
                self.excess, self.worst = excess, f"bound {bound:.3f}, {state}"
        return state

    def start(self) -> State:
        rng, count = self.rng, self.count
        spread = 10 ** rng.uniform(-2, 0.5, (count, 1, 1))
        common = unit(rng.normal(size=(count, 1, 3)))
        normals = unit(common + spread * rng.normal(size=(count, 3, 3)))
        wide = apart(normals)
        normals[wide] = normals[wide, :1]
        low, high = np.log10(self.range)
        return self.judged(
            State(
                light=unit(rng.normal((0, 0, 0.5))),
                parameter=10 ** rng.uniform(low, high),
                columns=int(10 ** rng.uniform(1.2, np.log10(WIDEST))),
                perspective=bool(rng.random() < 0.7),
                places=rng.uniform(0, 1, (count, 3, 2)),
                depths=rng.uniform(0, 1, (count, 3)) * rng.uniform(0, DEEPEST, (count, 1)),
                normals=normals,
                errors=np.zeros(count),
            )
        )

    def shared(self, state: State) -> State:
        """The state with another light, parameter, width or projection, if its largest error grew."""
        rng, by = self.rng, 10 ** self.rng.uniform(-3, 0)
        changes = [
            {"light": unit(state.light + by * rng.normal(size=3))},
            {"parameter": float(np.clip(state.parameter * 10 ** (by * rng.normal()), *self.range))},
            {"columns": int(np.clip(state.columns * 10 ** (by * rng.normal()), 8, WIDEST))},
            {"perspective": not state.perspective},
        ]
        other = self.judged(replace(state, **changes[rng.choice(4, p=(0.4, 0.3, 0.25, 0.05))]))
        return other if other.largest > state.largest else state

    def moved(self, state: State) -> State:
        """The state with those triangles that moved to a larger error."""
        rng, count = self.rng, self.count
        by = 10 ** rng.uniform(-4, -0.3, (count, 1, 1))
        depths = state.depths + DEEPEST * (by * rng.normal(size=(count, 3, 1)))[..., 0]
        depths = np.minimum(depths - depths.min(axis=1, keepdims=True), DEEPEST)
        normals = unit(state.normals + by * rng.normal(size=(count, 3, 3)))
        wide = apart(normals)
        normals[wide] = state.normals[wide]
        places = np.clip(state.places + by * rng.normal(size=(count, 3, 2)), 0, 1)
        other = self.judged(replace(state, places=places, depths=depths, normals=normals))
        grew = other.errors > state.errors
        members = {}
        for name in ("places", "depths", "normals", "errors"):
            new, old = getattr(other, name), getattr(state, name)
            members[name] = np.where(grew.reshape(-1, *[1] * (old.ndim - 1)), new, old)
        return replace(state, **members)

    def climb(self, rounds: int) -> State:
        """The worst state after some rounds from each of four starts, so that no peak holds the search."""
        best = None
        for _ in range(4):
            state = self.start()
            for turn in range(rounds // 4):
                state = self.shared(state) if turn % 4 == 3 else self.moved(state)
                if turn % 8 == 7:
                    # The better triangles take the places of the others.
                    kept = state.errors.argsort()[::-1][np.arange(self.count) % max(self.count // 4, 1)]
                    names = ("places", "depths", "normals", "errors")
                    state = replace(state, **{name: getattr(state, name)[kept] for name in names})
            if best is None or state.largest > best.largest:
                best = state
        return best
