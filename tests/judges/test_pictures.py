"""Visible triangles and colours of frames, compared with a conformant renderer's (Mesa's llvmpipe).

Its fragment program computes exact Blinn, true Phong and a bilinear texture in float32, from normals and
coordinates that it interpolates itself.
"""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.surface import design_for
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.golden.reference.transfer import decode, encode
from blysk.golden.render import Renderer
from blysk.sim.meshes.teapot import teapot

from ..oracle.caster import unit
from ..oracle.test_frames import COEFFICIENTS, LIGHT, MESHES, camera_of, view_of
from .conformant import Look

SIZE = 256, 192
BORDER = 0.002
"""Least |N·L| of the pixels that are compared."""
TIE = 2.0**-18
"""Surfaces whose nearness differs by less, as a share of the frame's range, may change places: 24-bit depth
and float32 planes."""


class Screen:
    """The triangles of a scene on the screen, by a camera that is not blysk's."""

    def __init__(self, scene: Scene):
        view, mesh = view_of(scene), scene.mesh
        x, y, far = view.places(mesh.vertices)
        self.faces, self.normals, self.size = (
            mesh.faces,
            mesh.normals[mesh.faces],
            (scene.width, scene.height),
        )
        self.places = np.round(np.stack([x, y], axis=-1) * 256)[mesh.faces] / 256
        self.w = (far if view.perspective else np.ones_like(far))[mesh.faces]
        near = 1 / far if view.perspective else -far
        # A little of the range stays free, so that no corner is clipped.
        self.nearness = (0.05 + 0.9 * (near - near.min()) / max(np.ptp(near), 1e-9))[mesh.faces]

    def drawn_by(self, judge, look: Look, coordinates=None, encoded=False):
        given = self.places, self.w, self.nearness, self.normals, look, self.size
        return judge.picture(*given, coordinates, encoded)

    def nearness_at(self, face: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Nearness of planes of triangles at pixel centres; -inf outside of the triangle and for no
        triangle."""
        point = np.stack([column + 0.5, row + 0.5], axis=-1)
        a, b, c = np.moveaxis(self.places[face], 1, 0)

        def area(p, q, r):
            return (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]

        shares = np.stack([area(point, b, c), area(a, point, c), area(a, b, point)], axis=-1)
        shares = shares / shares.sum(axis=-1, keepdims=True)
        found = (shares * self.nearness[face]).sum(axis=-1)
        return np.where((shares.min(axis=-1) >= -1e-12) & (face >= 0), found, -np.inf)

    def assert_same(self, judged: np.ndarray, owner: np.ndarray) -> int:
        """Assert that pixels show the same triangle, or two that are equally near. Returns the number of the
        second kind."""
        row, column = np.nonzero(judged != owner)
        near = [self.nearness_at(of[row, column], row, column) for of in (judged, owner)]
        assert np.isfinite(near).all(), "a pixel is covered by one renderer only"
        assert (np.abs(near[0] - near[1]) < TIE).all()
        return len(row)


def owner_of(scene: Scene) -> np.ndarray:
    """The triangle that each pixel shows, by the golden rasteriser."""
    raster, owner = rasterise(scene), np.full(scene.width * scene.height, -1)
    owner[raster.pixel[raster.visible]] = raster.triangle[raster.span[raster.visible]]
    return owner.reshape(scene.height, scene.width)


def scene_of(mesh: Mesh, camera: Camera, exponent: int, size=SIZE, **looks) -> Scene:
    return Scene(mesh, camera, *size, Material(*COEFFICIENTS, exponent, **looks), (Light(LIGHT),))


def named(name: str, projection: str, exponent: int = 50) -> Scene:
    """A sample mesh, or a teapot with the number of triangles that the name ends with."""
    if name.startswith("teapot "):
        mesh = teapot(int(name.split()[1]))
        camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, SIZE[0] / SIZE[1], 30.0)
        return scene_of(mesh, camera, exponent)
    return scene_of(MESHES[name], camera_of(name, projection), exponent)


def look_of(scene: Scene, mirror=False, image=None) -> Look:
    light, viewer = unit(LIGHT), -view_of(scene).forward
    return Look(tuple(light), tuple(viewer), *COEFFICIENTS, scene.material.exponent, mirror, image)


MESH_NAMES = (*MESHES, "teapot 10712")


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("name", MESH_NAMES)
def test_visible_triangles_of_sample_meshes(judge, name, projection):
    """Each pixel shows the same triangle, but for ties of depth."""
    scene = named(name, projection)
    screen = Screen(scene)
    _, judged, _ = screen.drawn_by(judge, look_of(scene))
    assert (judged >= 0).sum() > (100 if name == "needle" else 3000)
    assert screen.assert_same(judged, owner_of(scene)) <= 2


def crowd(seed: int, projection: str) -> Scene:
    """Triangles that cut through each other."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-1, 1, (150, 1, 3))
    points = (middle + rng.normal(0, 0.5, (150, 3, 3))).reshape(-1, 3)
    normals = unit(rng.normal((0, 0, 1), 0.3, (450, 3)))
    camera = Camera((0.2, 0.3, 7.0), (0, 0, 0), projection=projection, height=4.0, field_of_view=35.0)
    return scene_of(Mesh(points, np.arange(450).reshape(-1, 3), normals), camera, 20)


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_depth_order(judge, projection):
    """The golden rasteriser's depth, and the 24 bits of hardware geometry, order triangles as OpenGL does."""
    for seed in range(3):
        scene = crowd(seed, projection)
        screen = Screen(scene)
        _, judged, _ = screen.drawn_by(judge, look_of(scene))
        hardware = triangle_frame(scene, Renderer(preset("quotient", "blinn"))).owner
        assert len(np.unique(judged)) > 80
        for owner in (owner_of(scene), hardware):
            assert screen.assert_same(judged, owner) <= 2


def test_a_wrong_order_is_found(judge):
    """The judge's own picture with turned depths does not pass."""
    scene = crowd(0, "perspective")
    screen = Screen(scene)
    screen.nearness = 1 - screen.nearness
    _, judged, _ = screen.drawn_by(judge, look_of(scene))
    screen = Screen(scene)
    with pytest.raises(AssertionError):
        screen.assert_same(judged, owner_of(scene))


def largest_error(scene: Scene, image: np.ndarray, judged, owner: np.ndarray) -> float:
    """Largest error in LSB where both show the same triangle, away from the border of the light."""
    color, face, lit = judged
    sure = (face >= 0) & (face == owner) & (np.abs(lit) > BORDER)
    assert sure.sum() > 0.9 * (owner >= 0).sum()
    return float(np.abs(image - 255 * color)[sure].max())


def held(judge, scene: Scene, model: str) -> tuple[float, float]:
    """Largest error of a frame of `quotient` against the judge, and against the project's own float64."""
    design = preset("quotient", model)
    frame = model_frame(scene, design)
    judged = Screen(scene).drawn_by(judge, look_of(scene, model == "phong"))
    found = largest_error(scene, frame.image, judged, owner_of(scene))
    return found, compare(scene, design, frame).method_error.steady_lsb


FRAMES = [
    (name, projection, exponent, model)
    for row, name in enumerate(MESH_NAMES)
    for column, projection in enumerate(("perspective", "orthographic"))
    for exponent in ((1, 50, 1000)[(row + column) % 3],)
    for model in ("blinn", "phong")
]
SHORT = {("coarse torus", "perspective", 1, "blinn"), ("needle", "perspective", 50, "phong")}


@pytest.mark.parametrize(
    ("name", "projection", "exponent", "model"),
    [
        frame if frame in SHORT else pytest.param(*frame, marks=[pytest.mark.long, pytest.mark.ci])
        for frame in FRAMES
    ],
)
def test_colours(judge, name, projection, exponent, model):
    """Exact Blinn and true Phong of a fragment program, within the error that the project states."""
    found, own = held(judge, named(name, projection, exponent), model)
    assert 0.4 < found <= min(own + 0.1, 1)


@pytest.mark.parametrize("wrong", ["exponent", "model"])
def test_a_wrong_highlight_is_found(judge, wrong):
    scene = named("coarse torus", "perspective", 20)
    frame = model_frame(scene, preset("quotient", "blinn"))
    look = look_of(scene, wrong == "model")
    look.exponent += wrong == "exponent"
    judged = Screen(scene).drawn_by(judge, look)
    assert largest_error(scene, frame.image, judged, owner_of(scene)) > 2


def floor(texels: np.ndarray) -> Scene:
    """A floor that goes far away, with a bilinear texture in perspective."""
    points = np.array([[-4.0, 0, 1], [4, 0, 1], [4, 0, -30], [-4, 0, -30]])
    normals = unit([[-0.2, 1, 0.1], [0.3, 1, 0], [0.1, 1, -0.3], [-0.1, 1, 0.2]])
    mesh = Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]), normals, coordinates=points[:, ::2] / 3)
    camera = Camera((0.3, 1.2, 3.0), (0, 0.4, 0), projection="perspective", field_of_view=50.0)
    texture = Texture(texels, ("repeat", "repeat"), "bilinear", mipmapped=False)
    return scene_of(mesh, camera, 20, texture=texture)


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_textured_floor(judge, model):
    """In linear light; without its texture the floor is far off."""
    texels = np.random.default_rng(6).random((16, 32, 3))
    scene = floor(texels)
    frame = model_frame(scene, design_for(preset("quotient", model), scene))
    coordinates = scene.mesh.coordinates[scene.mesh.faces]
    judged = Screen(scene).drawn_by(judge, look_of(scene, model == "phong", texels), coordinates)
    assert largest_error(scene, frame.image, judged, owner_of(scene)) <= 1
    plain = replace(scene, material=Material(*COEFFICIENTS, 20))
    flat = model_frame(plain, preset("quotient", model))
    assert largest_error(plain, flat.image, judged, owner_of(plain)) > 20


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_textured_floor_in_codes_of_srgb(judge, model):
    """Against the judge's colours in float32, encoded by our formula; then against OpenGL's own codes.

    llvmpipe approximates the curve of sRGB. It decodes a texel up to 0.35 codes wrong, and encodes a colour
    up to 0.16 codes wrong. So its rounded codes differ from ours by a step at some pixels.
    """
    codes = np.random.default_rng(7).integers(0, 256, (16, 32, 3), dtype=np.uint8)
    texels = decode(codes / 255)
    scene = floor(texels)
    design = replace(design_for(preset("quotient", model), scene), transfer="srgb")
    frame = model_frame(scene, design)
    own = compare(scene, design, frame).method_error.steady_lsb
    screen, owner = Screen(scene), owner_of(scene)

    def drawn(image, encoded=False):
        look = look_of(scene, model == "phong", image)
        return screen.drawn_by(judge, look, scene.mesh.coordinates[scene.mesh.faces], encoded)

    color, *told = drawn(texels)
    exact = encode(color)
    assert 0.5 < largest_error(scene, frame.image, (exact, *told), owner) <= min(own + 0.01, 1)
    by_codes, *_ = drawn(codes)
    assert 0.1 < 255 * np.abs(encode(by_codes) - exact)[told[0] >= 0].max() < 0.35
    assert largest_error(scene, frame.image, (encode(by_codes), *told), owner) <= 1
    rounded, *_ = drawn(texels, encoded=True)
    assert 255 * np.abs(rounded - exact)[told[0] >= 0].max() < 0.5 + 0.16
    assert largest_error(scene, frame.image, (rounded, *told), owner) == pytest.approx(1)
    linear = model_frame(scene, replace(design, transfer="linear"))
    assert largest_error(scene, linear.image, (rounded, *told), owner) > 20
