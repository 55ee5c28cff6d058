"""Spans with values of each light, cut by error, against float64."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.cut import cut_by_error
from blysk.golden.frames.local import local_values
from blysk.golden.frames.prepare import sort_by_material
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.specular import Specular
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import fragment_positions, shade_spans
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

from .cuts import METHOD, ONE_VALUE, exact_operands, line_at, material, origins

CENTRE = np.array([0.0, 1.575, 0.0])


def lit_teapot(exponent, triangles=1000, viewer="near"):
    """The teapot under a lamp to the upper left, a lamp close to the lid, and the sun."""
    mesh = teapot(triangles)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 4 / 3, field_of_view=45)
    lamps = [Light(position=tuple(CENTRE + offset)) for offset in ([-3.2, 4.0, 4.5], [0.3, 2.1, 0.5])]
    return Scene(mesh, camera, 320, 240, material(exponent), (*lamps, Light((1, 1, 1))), viewer=viewer)


def floor(lamps, exponent=50, viewer="near", eye=(0, 1.5, 5)):
    """A square of two triangles, seen from so near that its spans are as wide as the picture."""
    vertices = np.array([[-4, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]], dtype=float)
    mesh = Mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]]), np.tile([0.0, 1, 0], (4, 1)))
    camera = Camera(eye, (0, 0, 0), projection="perspective", field_of_view=50)
    lights = tuple(Light(position=lamp) for lamp in lamps)
    return Scene(mesh, camera, 320, 200, material(exponent), lights, back_faces="show", viewer=viewer)


def local_errors(scene, by_material=False):
    """Diffuse and specular errors in LSB of full reflection, over all fragments and lights, and the cut
    spans."""
    raster = rasterise(scene)
    cut, count = cut_by_error(scene, raster, METHOD)
    if by_material:
        cut = sort_by_material(cut, scene.mesh.material)
    values = local_values(scene, cut)
    operands = METHOD.compute_values(values, cut.length)
    assert not operands.out_of_range.any()
    # Every fragment is found by its triangle and pixel.
    key, wanted = (
        r.triangle[r.span].astype(np.int64) * scene.width * scene.height + r.pixel for r in (cut, raster)
    )
    place = np.argsort(key)[np.searchsorted(np.sort(key), wanted)]
    assert np.array_equal(key[place], wanted)
    found, highlight = operands.cosine[place], operands.highlight[place]
    cosine, u = exact_operands(scene, raster)
    diffuse = Diffuse(found.format).compute(found).values
    specular, expected = np.zeros((2, *u.shape))
    unit = Specular(REFLECTION_MODELS["cosquad"], "one_minus_cosine")
    material = scene.mesh.material[raster.triangle[raster.span]]
    for index, coefficients in enumerate(scene.materials):
        which, n = material == index, coefficients.exponent
        specular[which] = unit.compute(highlight[which], Diffuse.dark(found[which]), n).values
        expected[which] = np.where(
            cosine[which] > 0, REFLECTION_MODELS["cosquad"].reflect(1 - u[which], n), 0
        )
    # Within a step of the words from 0, the sign of N·L may be wrong, and so may the highlight.
    sure = np.abs(cosine) > 2.0**-25
    return (
        255 * np.abs(diffuse - np.maximum(cosine, 0)).max(initial=0),
        255 * np.abs(specular - expected)[sure].max(initial=0),
        cut,
        count,
        expected,
    )


@pytest.mark.parametrize("exponent", [1, 10, 100, 1000])
@pytest.mark.parametrize("triangles", [100, 1000, 10_000])
def test_local_operands_of_the_teapot(exponent, triangles):
    """Fit, arithmetic and the last units together are under half an LSB of full reflection at every pixel.

    The fit and the arithmetic have 0.4 and 0.12 LSB. The specular unit's error adds up to 0.05 LSB, and the
    diffuse unit's 0.01 LSB.
    """
    diffuse, specular, cut, count, expected = local_errors(lit_teapot(exponent, triangles))
    print(
        f"{triangles} triangles, n = {exponent}: {diffuse:.3f}, {specular:.3f} LSB, {len(cut.length)} spans"
    )
    assert count > 0
    assert np.count_nonzero(expected > 0.1) > 20
    assert 0.03 < diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert 0.03 < specular <= METHOD.HIGHLIGHT_BUDGET + 0.05


LAMPS = {
    "high": [(0.5, 3.0, 0.5)],
    "low": [(0.5, 0.05, 0.5)],
    "in steps of pixels": [(0.3, 0.002, 1.0)],
    "on the surface": [(0.25, 0.0, 0.5)],
    "on a corner": [(4.0, 0.0, 4.0)],
    "behind": [(0.5, -1.0, 0.5)],
    "opposite to the viewer": [(0.0, -1.5, -5.0)],
    "at the camera": [(0.0, 1.5, 5.0)],
    "far": [(1e6, 2e6, 1e6)],
    "through the floor": [(0.0, 1.5, -5.0), (0.1, 1.5, -4.0)],
    "several": [(1.0, 0.3, 2.0), (-1.0, 0.1, 0.0), (0.0, -2.0, 0.0)],
}


@pytest.mark.parametrize("viewer", ["near", pytest.param("distant", marks=pytest.mark.long)])
@pytest.mark.parametrize("lamps", LAMPS)
@pytest.mark.parametrize("exponent", [50, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 1000))])
def test_stiff_lamps_over_a_floor(lamps, viewer, exponent):
    """In spans of hundreds of pixels L and H turn within a few pixels.

    The bounds hold, and no number is NaN.
    """
    # Seen from below, the lamps above are opposite: at some points L = -V and N·L is over 0.
    eye = (0, -1.5, 5) if lamps == "through the floor" else (0, 1.5, 5)
    scene = floor(LAMPS[lamps], exponent, viewer, eye)
    diffuse, specular, cut, _, _ = local_errors(scene)
    print(f"{lamps}, {viewer}, n = {exponent}: {diffuse:.3f}, {specular:.3f} LSB, {len(cut.length)} spans")
    assert diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert specular <= METHOD.HIGHLIGHT_BUDGET + 0.05
    # The parts show in the float64 renderer what the whole spans show.
    raster = rasterise(scene)
    whole = shade_spans(scene, raster, "normalised", REFLECTION_MODELS["cosquad"])
    parts = shade_spans(scene, cut, "normalised", REFLECTION_MODELS["cosquad"])
    assert np.isfinite(whole).all()
    lit = np.abs(exact_operands(scene, raster)[0]).min(axis=1) > 1e-9
    pixel = raster.pixel[lit & raster.visible]
    assert np.abs(whole - parts).reshape(-1, 3)[pixel].max(initial=0) <= 1e-9


def test_a_light_behind_cuts_nothing_but_what_turns():
    """Where N·L stays negative the light gives nothing, however large the errors of the quadratics are."""
    scene = floor([(0.5, -9.0, 0.5)], 10, "distant")
    above = replace(scene, lights=(Light(position=(0.5, 9.0, 0.5)),))
    fine, _ = cut_by_error(above, rasterise(scene), METHOD)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    operands = METHOD.compute_values(local_values(scene, cut), cut.length)
    assert (operands.cosine.codes < 0).all()
    assert len(cut.length) < 0.8 * len(fine.length)


def test_local_cut_keeps_fragments():
    scene = lit_teapot(50, 100)
    raster = rasterise(scene)
    cut, count = cut_by_error(scene, raster, METHOD)
    assert count == np.count_nonzero(np.bincount(origins(raster, cut)[0]) > 1)
    for name in ("pixel", "visible"):
        assert np.array_equal(getattr(cut, name), getattr(raster, name))
    origin, _ = origins(raster, cut)
    assert np.array_equal(np.bincount(origin, weights=cut.length), raster.length)
    assert np.array_equal(cut.triangle, raster.triangle[origin])
    # Positions and normals of the fragments are those of the whole spans.
    everything = np.arange(len(raster.span))
    points = (fragment_positions(scene, r, everything) for r in (raster, cut))
    assert np.abs(np.subtract(*points)).max() < 1e-12
    t = raster.offset / np.maximum(raster.length[raster.span] - 1, 1)
    curve = normalise(line_at(raster, raster.span, t))
    assert np.abs(fragment_normals(scene, cut, everything) - curve).max() < 1e-12


def test_local_values_by_hand():
    """The values of one span at its first, middle and last place, rounded to codes in units of
    ONE_SQUARED."""
    scene = floor([(0.5, 0.4, 0.5), (-1, 2, 1)])
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values = local_values(scene, cut)
    span = int(np.argmax(cut.length))
    length = int(cut.length[span])
    assert length > 3
    first = int(np.cumsum(cut.length)[span]) - length
    ends = fragment_positions(scene, cut, np.array([first, first + length - 1]))
    shares = [w / w.sum() for w in (cut.weights_left[span], cut.weights_right[span])]
    middle = cut.weights_left[span] + cut.weights_right[span]
    corners = scene.mesh.vertices[scene.mesh.faces[cut.triangle[span]]]
    points = shares[0] @ corners, middle / middle.sum() @ corners, shares[1] @ corners
    assert np.abs(ends - [points[0], points[2]]).max() < 1e-12
    # The floor is seen at a grazing angle, so the middle on the screen is not the middle in the world.
    eye = np.array(scene.camera.position)
    for index, light in enumerate(scene.lights):
        for place, point in enumerate(points):
            towards = np.subtract(light.position, point)
            towards /= np.linalg.norm(towards)
            sight = (eye - point) / np.linalg.norm(eye - point)
            half = (towards + sight) / np.linalg.norm(towards + sight)
            assert abs(values.diffuse[span, index, place] - ONE_VALUE * towards[1] * 2**25) < 0.51
            u = ((half - [0, 1, 0]) ** 2).sum() / 2
            assert abs(values.highlight[span, index, place] - ONE_VALUE * u * 2**26) < 0.51


def test_short_local_spans_do_not_bend():
    """A span of one pixel has one value. In a span of two pixels the middle value is the mean."""
    scene = lit_teapot(1000, 1000)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values = local_values(scene, cut)
    for codes in values:
        alone, pairs = codes[cut.length == 1], codes[cut.length == 2]
        assert len(alone) > 10
        assert len(pairs) > 10
        assert (alone == alone[..., :1]).all()
        assert np.abs(pairs[..., 0] + pairs[..., 2] - 2 * pairs[..., 1]).max() <= 2


def test_a_pipeline_of_more_lights():
    """If the pipeline has more lights than the scene, the further lights are dark in every pixel."""
    scene = lit_teapot(10, 100)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    three, five = local_values(scene, cut), local_values(scene, cut, 5)
    for a, b in zip(three, five, strict=True):
        assert np.array_equal(a, b[:, :3])
        assert not b[:, 3:].any()
    assert Diffuse.dark(METHOD.compute_values(five, cut.length).cosine)[:, 3:].all()


def test_no_light_and_no_span():
    scene = replace(lit_teapot(10, 100), lights=())
    cut, count = cut_by_error(scene, rasterise(scene), METHOD)
    assert local_values(scene, cut).diffuse.shape == (len(cut.length), 0, 3)
    assert count == np.count_nonzero(np.bincount(origins(rasterise(scene), cut)[0]) > 1)
    empty = replace(
        scene, mesh=replace(scene.mesh, faces=scene.mesh.faces[:0], material=scene.mesh.material[:0])
    )
    cut, count = cut_by_error(empty, rasterise(empty), METHOD)
    assert (count, len(cut.length), len(local_values(empty, cut).diffuse)) == (0, 0, 0)


def test_local_results_do_not_depend_on_the_chunks(monkeypatch):
    scene = lit_teapot(100, 100)
    raster = rasterise(scene)
    results = []
    for chunk in (1 << 16, 97):
        monkeypatch.setattr("blysk.golden.frames.local.CHUNK", chunk)
        cut, count = cut_by_error(scene, raster, METHOD)
        results.append((cut.length, count, *local_values(scene, cut)))
    for a, b in zip(*results, strict=True):
        assert np.array_equal(a, b)


def test_local_spans_by_material():
    """Each triangle has its own exponent. Spans may be sorted by their materials."""
    scene = lit_teapot(10, 1000)
    faces = len(scene.mesh.faces)
    mesh = replace(scene.mesh, material=np.arange(faces) % 2)
    scene = replace(scene, mesh=mesh, material=(material(1000), material(10)))
    diffuse, specular, cut, _, _ = local_errors(scene, by_material=True)
    assert diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert specular <= METHOD.HIGHLIGHT_BUDGET + 0.05
    assert len(np.unique(scene.mesh.material[cut.triangle])) == 2
