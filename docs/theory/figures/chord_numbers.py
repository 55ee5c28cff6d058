"""Numbers of chord.md."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from markdown import table

from blysk.bench.accuracy import scene_for
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.reflection import COSQUAD
from blysk.sim.meshes.teapot import teapot


def _sentences() -> list[str]:
    length = 255 * (1 - float(COSQUAD.reflect(1 - 1e-4, 1000)))
    chord_length = 255 * (1 - float(COSQUAD.reflect(1 - 1e-8 / 2, 1000)))
    bits = 255 * 1000 * 3 * 2.0**-17 / math.sqrt(3)
    return [
        f"costs {length:.1f} LSB at the peak of a highlight of n = 1000 by the dot product, "
        f"and {chord_length:.4f} LSB by the chord",
        f"up to {bits:.1f} LSB",
    ]


def _fading_lights(mesh: Mesh) -> dict[str, Light]:
    """Point lights above a mesh: as bright everywhere, fading by the distance, and spots at its middle."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, far = (low + high) / 2, 0.9 * np.linalg.norm(high - low)
    place = middle + far * normalise(np.array([-0.5, 0.8, 0.7]))
    bare = Light(position=tuple(place))
    spot = replace(bare, spot=tuple(middle - place), cone=(10, 20))
    by_distance = replace(bare, color=(4.0,) * 3, attenuation=(1.0, 0.0, 15 / far**2))
    return {
        "point light": bare,
        "by distance": replace(bare, attenuation=(0.0, 0.0, 1 / (0.4 * far) ** 2)),
        "spot": spot,
        "narrow border": replace(spot, cone=(8, 9)),
        "both, 4 times white": replace(by_distance, spot=spot.spot, cone=spot.cone),
    }


def _factors() -> str:
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    flat = Mesh(square, faces, np.tile([0.0, 1.0, 0.0], (4, 1)), material=np.zeros(2, np.int64))
    rows = []
    for name, mesh in {
        "teapot, 992": teapot(1_000),
        "teapot, 10,712": teapot(10_000),
        "square, 2": flat,
    }.items():
        lights = _fading_lights(mesh)
        for projection in ("perspective", "orthographic"):
            camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, 4 / 3)
            row = [name, projection]
            for light in lights.values():
                design = preset("chord-local", "blinn", factors=(0,) if light.fades else ())
                errors, cuts = [], {}
                for exponent in (1, 50, 1000):
                    scene = replace(scene_for(mesh, exponent, 320, 240), lights=(light,), camera=camera)
                    frame = model_frame(scene, design)
                    errors.append(compare(scene, design, frame).total_error.max_lsb)
                    cuts[exponent] = frame.spans / len(frame.raster.length)
                row.append(f"{max(errors):.2f}, {cuts[50]:.2f}")
            rows.append(row)
    return table(["mesh, triangles", "projection", *lights], rows, 2)


TABLES: dict[str, Callable[[], str]] = {"chord-factors": _factors}
SENTENCES: dict[str, Callable[[], list[str]]] = {"chord.md": _sentences}
