"""Bands against whole frames, and against the exact frame of every pixel."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.surface import albedo_of, fixed_albedo_of
from blysk.golden.geometry.scene_triangles import scene_triangles
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.golden.video.controls import Controls
from blysk.golden.video.draw_commands import KINDS, DrawCommands
from blysk.golden.video.draw_unit import Drawing, board_design, turned
from blysk.golden.video.vertex_unit import VertexTransform
from blysk.sim.meshes.teapot import teapot

SIZE = 160, 120
LOOKS = "colors", "coordinates"


def scene(triangles=400, size=SIZE, back_faces="cull", distance=1.0):
    mesh = teapot(triangles)
    camera = Camera.framing(mesh.vertices, (0.3, 0.5, 1), "perspective", size[0] / size[1], margin=0.12)
    if distance != 1:
        toward = np.subtract(camera.position, camera.target) * distance + camera.target
        camera = replace(camera, position=tuple(toward.tolist()))
    material = Material((0.1, 0.05, 0.05), (0.6, 0.3, 0.2), (0.7, 0.7, 0.7), 60)
    return Scene(mesh, camera, *size, material, (Light((0.5, 0.8, 1)),), back_faces=back_faces)


@pytest.mark.parametrize(("lines", "angle"), [(16, 8), (16, 1500), (7, 3000)])
def test_bands_are_the_whole_frame(lines, angle):
    """Bands equal the whole frame to the bit. With bands of 7 lines the last band has one line."""
    drawing = Drawing.of([scene()], lines=lines)
    whole, image = drawing.whole(angle), np.zeros((*SIZE[::-1], 3), dtype=np.uint8)
    image[whole.y, whole.x] = whole.color
    np.testing.assert_array_equal(drawing.picture(angle), image)
    assert len(whole.x) > 3000


def rounded_coordinates(drawing, exact, found):
    """Vertices of the drawing with other coordinates: those of float64, rounded to the grid."""
    sent = scene_triangles(exact)
    x, y = found.x.copy(), found.y.copy()
    faces = exact.mesh.faces[sent.source]
    x[faces], y[faces] = sent.triangles.x, sent.triangles.y
    # The coordinates differ by at most a step.
    assert max(np.abs(x - found.x).max(), np.abs(y - found.y).max()) <= 1
    return replace(found, x=x, y=y)


def test_a_turned_mesh_keeps_its_looks():
    shown = scene()
    count = len(shown.mesh.vertices)
    mesh = replace(shown.mesh, colors=np.full((count, 3), 0.5), coordinates=np.ones((count, 2)))
    found = turned(replace(shown, mesh=mesh), 2000).mesh
    for name in ("faces", "material", "colors", "coordinates"):
        np.testing.assert_array_equal(getattr(found, name), getattr(mesh, name))
    assert (found.normals != mesh.normals).any()


@pytest.mark.parametrize("angle", [8, 2000])
def test_error_is_that_of_shading_and_of_rounded_coordinates(angle, monkeypatch):
    """With the coordinates of the exact frame no pixel is off by 0.6 LSB.

    The drawing's own coordinates differ by a step.
    """
    shown = scene()
    drawing = Drawing.of([shown])
    error = errors_with_exact_coordinates(drawing, shown, angle, monkeypatch)
    assert error.max() < 0.6


def errors_with_exact_coordinates(drawing, shown, angle, monkeypatch, preset=0):
    """Errors in LSB of the drawn pixels, and of the float64 frame with its own coordinates."""
    exact = turned(shown, angle)
    frame = render(exact, "phong", drawing.renderer.design.specular.reflection)
    vertices = rounded_coordinates(drawing, exact, drawing.vertices(angle, preset))
    monkeypatch.setattr(Drawing, "vertices", lambda self, angle, preset: vertices)
    whole = drawing.whole(angle, preset)
    monkeypatch.undo()
    drawn = np.zeros(SIZE[::-1], dtype=bool)
    drawn[whole.y, whole.x] = True
    np.testing.assert_array_equal(drawn, frame.mask)
    picture = np.zeros((*SIZE[::-1], 3))
    picture[whole.y, whole.x] = whole.color
    return np.abs(picture - 255 * frame.image)[drawn]


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_several_lights(monkeypatch, model):
    """Two lists with several lights: each has matrices into the frame of its first light, and axes of the
    other lights in this frame."""
    shown = scene()
    lights = Light((0.5, 0.8, 1)), Light((-1, 0.3, 0.4), (0.3, 0.6, 0.1)), Light((0.2, -1, 0.1))
    scenes = replace(shown, lights=lights), replace(shown, lights=lights[:0:-1])
    drawing = Drawing.of(scenes, preset("quotient", model, lights=3))
    for index, each in enumerate(scenes):
        assert errors_with_exact_coordinates(drawing, each, 2000, monkeypatch, index).max() < 0.65
        normal = drawing.vertices(2000, index).normal
        assert np.linalg.norm(normal, axis=1).max() < 2**23 * (1 + 2.0**-13)


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_each_light_has_matrices_into_its_frame(monkeypatch, model):
    """Lights have any direction, that of the viewer, the opposite direction, and none.

    Equal lights share a slot.
    """
    shown = scene()
    viewer = shown.camera.viewer
    lamps = (0.5, 0.8, 1), viewer, -viewer, (-1, 0.3, 0.4), (0.5, 0.8, 1)
    scenes = [replace(shown, lights=(Light(tuple(lamp)),)) for lamp in lamps]
    drawing = Drawing.of(
        [*scenes, replace(shown, lights=())], preset("quotient", model), controls=Controls(lights=6)
    )
    lists = [drawing.commands.compute(start, True) for start in drawing.commands.starts]
    slots = [words[words[:, 0] == KINDS.index("transform"), 1].item() for words in lists]
    assert slots[4] == slots[0]
    assert len(set(slots)) == drawing.motion.slots
    assert drawing.motion.slots <= 5
    for index, each in enumerate(scenes[:4]):
        assert errors_with_exact_coordinates(drawing, each, 2000, monkeypatch, index).max() < 0.6
    dark = 255 * shown.material.ambient[0]
    assert np.abs(drawing.whole(2000, 5).color[:, 0] - dark).max() <= 0.5


@pytest.mark.parametrize("angle", [8, 2000])
def test_error_against_exact_normals_of_every_pixel(angle):
    """Coordinates that differ by a step matter at the outline, and where triangles are seen at a grazing
    angle."""
    shown = scene()
    drawing = Drawing.of([shown])
    whole = drawing.whole(angle)
    drawn = np.zeros(SIZE[::-1], dtype=bool)
    drawn[whole.y, whole.x] = True
    exact = render(turned(shown, angle), "phong", drawing.renderer.design.specular.reflection)
    assert (drawn ^ exact.mask).sum() <= 3
    both = drawn & exact.mask
    error = np.abs(drawing.picture(angle)[both] - 255 * exact.image[both]).max(axis=1)
    assert (error > 1).mean() < 0.005
    assert np.sqrt((error**2).mean()) < 0.6


def test_triangles_near_the_camera_are_dropped_and_counted():
    near = scene(distance=0.3)
    drawing = Drawing.of([near])
    outside = drawing.vertices(0).outside
    assert 0 < outside.sum() < len(outside)
    kept, counts = drawing.triangles(0, 0, drawing.frames[0])
    touched = outside[drawing.mesh.faces].any(axis=1)
    assert counts["outside"] == touched.sum()
    assert len(kept) + counts["rejected"] == (~touched).sum()


def test_commands_of_a_scene():
    """A frame's first band has constants and the transform, and every band has the draw."""
    drawing = Drawing.of([scene(), replace(scene(), ambient_light=(0, 0, 0))])
    assert len(drawing.commands.starts) == 2
    first, other = (drawing.commands.compute(drawing.commands.starts[1], begins) for begins in (True, False))
    assert [KINDS[kind] for kind in other[:, 0]] == ["draw", "end"]
    writes = first[first[:, 0] == KINDS.index("frame_constant")]
    wanted = drawing.presets[1][0].writes()
    np.testing.assert_array_equal(writes[:, 1], wanted["address"])
    np.testing.assert_array_equal(writes[:, 2] | writes[:, 3] << 12, wanted["data"])


def test_a_padded_drawing_sends_the_same_triangles():
    """Lists of other lengths, a second material, and another mesh have the same memories but for words."""
    first = Drawing.of([scene(64), replace(scene(64), lights=(Light((1, 0, 0)),))])
    room = first.room
    assert room == (512, 512, 768)
    padded = first.padded(room)
    assert padded.room == room
    for preset_index in (0, 1):
        kept, made = (each.triangles(700, preset_index, each.rows(3)) for each in (first, padded))
        assert made[1] == kept[1]
        for name in ("x", "y", "depth", "normal", "material"):
            np.testing.assert_array_equal(getattr(made[0], name), getattr(kept[0], name))
    other = Drawing.of([scene(200)] * 2).padded(room)
    assert other.commands.starts == padded.commands.starts == (0, 768)
    for sizes in (
        lambda each: len(each.commands.words),
        lambda each: each.motion.slots,
        lambda each: each.room,
    ):
        assert sizes(other) == sizes(padded)
    with pytest.raises(ValueError, match=r"a memory for [0-9]+ to 4095 triangles, not 9"):
        first.padded(room._replace(triangles=9))
    with pytest.raises(ValueError, match=r"a list of [0-9]+ commands does not fit a memory for 20"):
        first.padded(room._replace(commands=20))


def colored(shown, parts):
    """The scene with vertex colours and with an image of 16x8 texels, as far as ``parts`` name them."""
    rng, mesh = np.random.default_rng(4), shown.mesh
    looks = {"colors": rng.random((len(mesh.vertices), 3)), "coordinates": mesh.vertices[:, :2] * 0.9}
    mesh = replace(mesh, **{name: value for name, value in looks.items() if name in parts})
    image = Texture(rng.random((8, 16, 3)), ("repeat", "mirror"), mipmapped=False)
    texture = image if "coordinates" in parts else None
    return replace(shown, mesh=mesh, material=replace(shown.material, texture=texture))


@pytest.mark.parametrize(
    "parts", [("colors", "coordinates"), *(pytest.param((p,), marks=pytest.mark.long) for p in LOOKS)]
)
def test_colours_and_textures(parts, monkeypatch):
    """Bands equal the whole frame. With the coordinates of the exact frame no pixel is off by 0.7 LSB."""
    shown = colored(scene(), parts)
    design = replace(board_design(), albedo=fixed_albedo_of(shown))
    drawing = Drawing.of([shown], design, lines=40)
    whole, image = drawing.whole(700), np.zeros((*SIZE[::-1], 3), dtype=np.uint8)
    image[whole.y, whole.x] = whole.color
    np.testing.assert_array_equal(drawing.picture(700), image)
    assert errors_with_exact_coordinates(drawing, shown, 700, monkeypatch).max() < 0.7


def test_colours_that_a_drawing_does_not_take_are_refused():
    shown = colored(scene(64), LOOKS)
    design = replace(board_design(), albedo=fixed_albedo_of(shown))
    texture = replace(shown.material.texture, mipmapped=True)
    with pytest.raises(ValueError, match="takes level 0 of a texture"):
        Drawing.of([replace(shown, material=replace(shown.material, texture=texture))], design)
    with pytest.raises(ValueError, match="the scene has vertex colours, and the design does not"):
        Drawing.of([shown])
    with pytest.raises(ValueError, match="the texels of a drawing must be fixed"):
        Drawing.of([shown], replace(design, albedo=albedo_of(shown)))
    other = replace(shown.material, texture=replace(shown.material.texture, texels=np.zeros((8, 16, 3))))
    with pytest.raises(ValueError, match="the texels of the design are fixed"):
        Drawing.of([shown, replace(shown, material=other)], design)
    drawing = Drawing.of([shown], design)
    with pytest.raises(ValueError, match="the mesh brings other attributes"):
        replace(drawing, transform=VertexTransform())


def test_what_does_not_fit_is_refused():
    drawing = Drawing.of([scene()])
    with pytest.raises(ValueError, match="a band of 160x8 has 8 and 3"):
        replace(drawing, lines=8)
    with pytest.raises(ValueError, match="choose from 2 lists, but there are 1"):
        replace(drawing, controls=Controls(lights=2))
    with pytest.raises(ValueError, match="last must be an end"):
        DrawCommands(np.array([[1, 0, 0, 1]]), (0,))


@pytest.mark.parametrize(
    ("words", "starts", "message"),
    [
        ([["transform", 1, 0, 10]], (0,), "transform has index up to 1, past 0"),
        ([["transform", 0, 1, 10]], (0,), "transform has range up to 10, past 9"),
        ([["draw", 3, 0, 6]], (0,), "draw has index up to 3, past 2"),
        ([["draw", 0, 4, 3]], (0,), "draw has range up to 6, past 5"),
        ([["draw", 0, 0, 6]], (0, 2), "must begin at a command, 0 to 1, not 2"),
        ([["draw", 0, 0, 6]], (-1,), "must begin at a command, 0 to 1, not -1"),
    ],
)
def test_commands_past_an_end(words, starts, message):
    """These commands would wrap in hardware to other slots, materials, vertices, triangles, or commands, so
    they are refused."""
    rows = [[KINDS.index(kind), *rest] for kind, *rest in words] + [[0, 0, 0, 0]]

    def check():
        commands = DrawCommands(np.array(rows), starts)
        commands.check("transform", index=1, range=10)
        commands.check("draw", index=3, range=6)

    with pytest.raises(ValueError, match=message):
        check()


def test_drawings_refuse_what_is_past_an_end():
    drawing = Drawing.of([scene(64)])
    mesh, words = drawing.mesh, drawing.commands.words.copy()
    with pytest.raises(ValueError, match="a corner must be a vertex"):
        replace(mesh, faces=np.where(mesh.faces == 0, mesh.vertices, mesh.faces))
    with pytest.raises(ValueError, match="slots are 0 to 0, not -1 to -1"):
        drawing.motion.matrix(-1, 0)
    words[words[:, 0] == KINDS.index("draw"), 3] += 1
    with pytest.raises(ValueError, match="a command draw has range up to"):
        replace(drawing, commands=replace(drawing.commands, words=words))
