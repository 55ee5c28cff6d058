"""Stiff and extreme cases: scenes with their spans, by groups."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material, halfway_vector
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.mesh import load_mesh

__all__ = [
    "ANGLES",
    "EXPONENTS",
    "GROUPS",
    "HALFWAY",
    "LENGTHS",
    "Case",
    "arcs",
    "cases_of",
    "single_spans",
]


GROUPS = {
    1: "exponents",
    2: "angle of a span",
    3: "length of a span",
    4: "the highlight's peak",
    5: "light at the terminator, behind, at the viewer",
    6: "normals that are not of unit length",
    7: "4095 pixels, largest sums",
    8: "intensities over 1, many lights",
    9: "triangles without area, slivers, triangles at the edges",
}
"""Groups of cases by number. The text is the quantity that is extreme."""

EXPONENTS = (1, 2, 3, 10, 100, 500, 1000)

ANGLES = (0.0, 1e-4, 1.0, 45.0, 89.9, 90.0, 120.0, 180.0)

LENGTHS = (1, 2, 3, 16, 4095)

_LIGHT = normalise((0.3, 0.5, 0.8))

_VIEWER = normalise((-0.2, 0.1, 1.0))

HALFWAY = halfway_vector(_LIGHT, _VIEWER)

_COLORS = (0.05,) * 3, (0.4,) * 3, (0.55,) * 3


@dataclass(frozen=True)
class Case:
    """A case: spans to shade, and their light and material.

    Parameters
    ----------
    group : int
        One of `GROUPS`.
    name : str
        Description of the extreme property.
    scene : Scene
        Size, material, lights and viewer.
    raster : Raster
        The spans. They cover every pixel of the reference picture once.
    codes : pair of int arrays, shape (spans, 3), optional
        Codes of the end normals for the pipeline, if the normals are not of unit length. The normals of the
        raster are then the values of these codes.
    """

    group: int
    name: str
    scene: Scene
    raster: Raster
    codes: tuple[np.ndarray, np.ndarray] | None = None


def arcs(
    rng: np.random.Generator,
    centre: np.ndarray,
    degrees: np.ndarray,
    at: np.ndarray = 0.5,
    off: np.ndarray = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Ends of spans on great circles, in random planes about a vector.

    Parameters
    ----------
    rng : Generator
        Source of the random planes.
    centre : array, shape (3,)
        Unit vector.
    degrees : array, shape (spans,)
        Angle between the ends.
    at : array, shape (spans,)
        Place in the span that is nearest to the vector: 0 to 1 inside the span, other values before or after
        it.
    off : array, shape (spans,)
        Angle, in degrees, between the vector and the span at that place.

    Returns
    -------
    left, right : float64 arrays, shape (spans, 3)
    """
    psi, at, off = np.broadcast_arrays(np.radians(degrees), at, np.radians(off))
    side = normalise(np.cross(centre, rng.normal(size=(psi.size, 3))))
    nearest = np.cos(off)[:, np.newaxis] * centre + np.sin(off)[:, np.newaxis] * np.cross(centre, side)
    angles = np.stack([-at * psi, (1 - at) * psi])[..., np.newaxis]
    left, right = nearest * np.cos(angles) + side * np.sin(angles)
    return left, right


def single_spans(
    group: int,
    name: str,
    ends: tuple[np.ndarray, np.ndarray],
    length: np.ndarray | int,
    exponent: int,
    lights: Sequence[Light] = (Light(tuple(_LIGHT)),),
    viewer: np.ndarray = _VIEWER,
    colors: tuple = _COLORS,
    codes: tuple[np.ndarray, np.ndarray] | None = None,
) -> Case:
    """A case of single spans. Each row of the picture has one span."""
    left, right = ends
    count = len(left)
    length = np.broadcast_to(length, count).astype(np.int32)
    # A span of one pixel has a single normal.
    right = np.where(length[:, np.newaxis] == 1, left, right)
    span, offset = pixels_of(length)
    width = int(length.max())
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.eye(3))
    scene = Scene(
        mesh, Camera(tuple(viewer), (0, 0, 0)), width, count, Material(*colors, exponent), tuple(lights)
    )
    corner = np.zeros((2, count, 3))
    corner[0, :, 0] = corner[1, :, 1] = 1
    ones, none = np.ones(count), np.zeros(count, dtype=np.int32)
    raster = Raster(
        x=none,
        y=np.arange(count, dtype=np.int32),
        length=length,
        triangle=none,
        normal_left=left,
        normal_right=right,
        magnitude_left=ones,
        magnitude_right=ones,
        weights_left=corner[0],
        weights_right=corner[1],
        back=none.astype(bool),
        span=span.astype(np.int32),
        offset=offset.astype(np.int16),
        pixel=(span * width + offset).astype(np.int32),
        visible=np.ones(len(span), dtype=bool),
        triangles=1,
        **dict.fromkeys(("degenerate", "culled", "outside", "uncovered", "hidden_spans"), 0),
        repaired_normals=0,
    )
    return Case(group, name, scene, raster, codes)


def cases_of(group: int) -> Iterator[Case]:
    """The cases of a group, the same on every call.

    Parameters
    ----------
    group : int
        One of `GROUPS`.
    """
    rng = np.random.default_rng(group)

    def about(degrees, off):
        count = len(degrees)
        return arcs(rng, HALFWAY, degrees, rng.uniform(0, 1, count), rng.uniform(0, off, count))

    match group:
        case 1:
            for exponent in EXPONENTS:
                # Up to the end of the highlight.
                off = rng.uniform(0, min(60, 120 / exponent**0.5), 100)
                ends = arcs(rng, HALFWAY, rng.uniform(0, 44.9, 100), rng.uniform(-0.5, 1.5, 100), off)
                yield single_spans(1, f"exponent {exponent}", ends, rng.integers(2, 41, 100), exponent)
        case 2:
            for degrees in ANGLES:
                # The number of pixels is even, because opposite normals have no normal in the middle.
                yield single_spans(2, f"{degrees:g} degrees", about(np.full(60, degrees), 30), 16, 50)
        case 3:
            for length in LENGTHS:
                name = f"{length} pixels" if length > 1 else "1 pixel"
                yield single_spans(3, name, about(rng.uniform(0, 44.9, 8), 9), length, 100)
        case 4:
            for name, length, at, degrees in (
                ("on a pixel", 17, 0.5, 20),
                ("between two pixels", 16, 0.5, 20),
                ("on the last pixel", 17, 1.0, 20),
                ("narrower than a pixel, on a pixel", 3, 0.5, 40),
                ("narrower than a pixel, between two pixels", 4, 0.5, 40),
                ("highlight inside one span", 65, 0.4, 30),
            ):
                ends = arcs(rng, HALFWAY, np.full(40, degrees), at)
                yield single_spans(4, name, ends, length, MAX_EXPONENT)
        case 5:
            yield from _light_cases(rng)
        case 6:
            yield from _length_cases(rng)
        case 7:
            for degrees in (1, 20, 44.9):
                name = f"4095 pixels, {degrees:g} degrees"
                yield single_spans(7, name, about(np.full(4, degrees), 0), 4095, MAX_EXPONENT)
            axis = np.array([0.0, 0.0, 1.0])
            for name, centre in (("N along L and H", axis), ("N against L and H: 1 - N.H is 2", -axis)):
                ends = arcs(rng, centre, np.full(4, 44.9), (0.0, 0.5, 0.5, 1.0))
                yield single_spans(7, name, ends, 4095, MAX_EXPONENT, [Light(tuple(axis))], axis)
        case 8:
            ends = about(rng.uniform(0, 40, 60), 20)
            over = (0.5,) * 3, (0.9,) * 3, (0.8,) * 3
            yield single_spans(8, "k_a + k_d + k_s = 2.2", ends, 20, 20, colors=over)
            yield single_spans(8, "light of intensity 3", ends, 20, 20, [Light(tuple(_LIGHT), (3.0,) * 3)])
            around = normalise(_LIGHT + rng.uniform(-0.7, 0.7, (16, 3)))
            for name, share in (("16 lights of intensity 1/16", 1 / 16), ("16 lights of intensity 1", 1.0)):
                yield single_spans(8, name, ends, 20, 20, [Light(tuple(v), (share,) * 3) for v in around])
        case 9:
            yield from _triangle_cases(rng)
        case _:
            raise ValueError(f"there is no group {group}")


def _light_cases(rng) -> Iterator[Case]:
    viewer = np.array([0.0, 0.0, 1.0])
    side = np.array([1.0, 0.0, 0.0])
    for degrees in (1e-3, 20):
        for exponent in (1, 100):
            # Along most spans the normals begin on the side of the light, and end on the other side.
            ends = arcs(rng, viewer, np.full(40, degrees))
            light = normalise(side + np.radians(degrees / 8) * viewer)
            name = f"terminator in a span of {degrees:g} degrees, exponent {exponent}"
            yield single_spans(5, name, ends, 64, exponent, [Light(tuple(light))], viewer)
    ends = arcs(rng, viewer, rng.uniform(0, 40, 40), 0.5, rng.uniform(0, 30, 40))
    for name, light in (
        ("light behind", normalise((0.1, 0.2, -1))),
        ("L = -V, no half-way vector", -viewer),
        ("L = V", viewer),
    ):
        yield single_spans(5, name, ends, 33, 10, [Light(tuple(light))], viewer)


def _length_cases(rng) -> Iterator[Case]:
    def of_codes(name, left, right):
        ends = left / ONE, right / ONE
        return single_spans(6, name, ends, 9, 10, codes=(left, right))

    ends = arcs(rng, HALFWAY, rng.uniform(0, 44, 60), rng.uniform(0, 1, 60), rng.uniform(0, 20, 60))
    inside = np.maximum(*np.abs(ends)).max(axis=1) < 0.99
    ends = [end[inside] for end in ends]
    codes = [_codes(end) for end in ends]
    nothing = np.zeros_like(codes[0])
    yield of_codes("both normals 0", nothing, nothing)
    yield of_codes("one normal 0", nothing, codes[1])
    for name, scales in (
        ("length 1 - 1/256", (255 / 256, 255 / 256)),
        ("length 1 + 1/256", (257 / 256, 257 / 256)),
        ("length 1 - 1/256 and 1 + 1/256", (255 / 256, 257 / 256)),
    ):
        yield of_codes(name, *(_codes(end * scale) for end, scale in zip(ends, scales, strict=True)))
    axes = np.vstack([COMPONENT.max_code * np.eye(3, dtype=int), COMPONENT.min_code * np.eye(3, dtype=int)])
    yield of_codes("largest and smallest code of a component", axes, axes)
    pairs = [axes[k] for k in np.nonzero(~np.eye(6, dtype=bool))]
    yield of_codes("largest and smallest codes, 90 and 180 degrees apart", *pairs)
    full = COMPONENT.max_code * np.array([[1, 1, 1], [0, 1, 1], [1, 0, 1]])
    yield of_codes("length sqrt 2 and sqrt 3", full, full[[1, 2, 0]])
    yield _mended_mesh()


def _codes(vectors: np.ndarray) -> np.ndarray:
    """Codes of vectors of any length."""
    return np.floor(vectors * ONE + 0.5).astype(np.int64)


def _mended_mesh() -> Case:
    """Case of a mesh that `load_mesh` repaired. Its file has normals that are NaN, 0 and too long."""
    text = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn nan 0 1\nvn 0 0 0\nvn 0.3 0 3\nvn 0 0.2 1\n"
    with TemporaryDirectory() as folder:
        path = Path(folder, "broken.obj")
        path.write_text(f"{text}f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n", encoding="ascii")
        mesh = load_mesh(str(path)).mesh
    return _scene_case(6, "a mesh with normals NaN, 0 and 3 long", mesh)


def _scene_case(group: int, name: str, mesh: Mesh, camera: Camera | None = None) -> Case:
    camera = camera or Camera.framing(mesh.vertices, tuple(_VIEWER), "perspective", 1.0)
    scene = Scene(mesh, camera, 64, 64, Material(*_COLORS, 50), [Light(tuple(_LIGHT))])
    return Case(group, name, scene, rasterise(scene))


def _triangle_cases(rng) -> Iterator[Case]:
    def bent(vertices, faces):
        vertices = np.array(vertices, dtype=np.float64)
        return Mesh(vertices, np.array(faces), normalise(vertices * (0.5, 0.5, 0) + (0, 0, 1)))

    plate = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    yield _scene_case(9, "two triangles that share an edge", bent(plate, [(0, 1, 2), (0, 2, 3)]))
    flat = bent([*plate, (0, 0, 0)], [(0, 1, 2), (0, 4, 2), (0, 0, 3), (1, 1, 1)])
    yield _scene_case(9, "triangles without area beside a triangle with area", flat)
    slivers = [(-1, y / 10, 0) for y in range(-9, 10)], [(1, y / 10 + 0.011, 0) for y in range(-9, 10)]
    tips = [(1, y / 10 + 0.012, 0) for y in range(-9, 10)]
    faces = [(k, 19 + k, 38 + k) for k in range(19)]
    yield _scene_case(9, "slivers narrower than a pixel", bent([*slivers[0], *slivers[1], *tips], faces))
    tall = [(x + dx, y, 0) for x in (-0.8, 0.1, 0.7) for dx, y in ((0, -1), (0.03, -1), (0.3, 1))]
    yield _scene_case(9, "spans of one pixel", bent(tall, np.arange(9).reshape(3, 3)))
    dots = np.add(rng.uniform(-1, 1, (60, 1, 2)), [(0, 0), (0.04, 0), (0, 0.04)])
    dots = np.dstack([dots, np.zeros((60, 3))]).reshape(-1, 3)
    yield _scene_case(9, "triangles of one pixel", bent(dots, np.arange(180).reshape(60, 3)))
    large = bent(np.multiply(plate, 400), [(0, 1, 2), (0, 2, 3)])
    large = replace(large, normals=bent(plate, [(0, 1, 2)]).normals)
    straight = Camera((0, 0, 4), (0, 0, 0), projection="perspective")
    yield _scene_case(9, "mostly off the picture", large, straight)
    low = Camera((0, -0.5, 0.05), (0, 0.5, 0), projection="perspective", field_of_view=90)
    yield _scene_case(9, "through the near plane", bent(plate, [(0, 1, 2), (0, 2, 3)]), low)
