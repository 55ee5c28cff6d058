"""Matrices of turning meshes against a camera in float64."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.texture import Texture
from blysk.golden.video.mesh_memory import MeshMemory, block_rams
from blysk.golden.video.motion import Motion, rotation
from blysk.golden.video.vertex_unit import VertexTransform
from blysk.sim.meshes.teapot import teapot

SIZE = 640, 480
AXIS = 0.2, 1.0, 0.1
MOVED = (1, 100), (100, 0)
"""Scales and distances of texture coordinates that are too far from an image, and too far apart."""


@pytest.fixture(scope="module")
def memory():
    return MeshMemory.of([teapot(300)])


@pytest.fixture(scope="module")
def camera(memory):
    return Camera.framing(memory.world(memory.parts[0]).vertices, (0.3, 0.5, 1), "perspective", margin=0.2)


@pytest.mark.parametrize("angle", [0, 511, 1024, 2500, 4095])
def test_vertices_land_where_the_camera_sees_them(memory, camera, angle):
    """The bound counts the rounding of the matrix: with 16 fraction bits it is less than 1.5 steps of 1/256
    pixel."""
    motion, part = Motion.of(memory, camera, SIZE, AXIS), memory.parts[0]
    found = VertexTransform().compute(memory.position, memory.normal, motion.matrix(0, angle))
    world = Fixed(COMPONENT, memory.position).values * part.scale
    turned = world @ rotation(AXIS, Motion.radians(angle)).T + part.centre
    exact = camera.project(turned, *SIZE)
    x, y = (found.x / 256 + SIZE[0] / 2, found.y / 256 + SIZE[1] / 2)
    assert not found.outside.any()
    assert max(np.abs(x - exact[:, 0]).max(), np.abs(y - exact[:, 1]).max()) * 256 < 4
    depth = (1 - camera.near / exact[:, 2]) * 2.0**24
    assert np.abs(found.depth - depth).max() < 2.0**24 * 2 * Motion.ENTRY_ERROR * np.sqrt(3)


def test_entries_are_within_their_bound(memory, camera):
    motion, angle = Motion.of(memory, camera, SIZE, AXIS), np.arange(4096)
    found = motion.compute(np.zeros(4096, dtype=np.int64), angle)
    exact = np.stack([rotation(AXIS, Motion.radians(code)).ravel() for code in angle.tolist()])
    error = np.abs(found[:, 12:] * 2.0**-16 - exact).max()
    assert 2.0**-17 < error <= Motion.ENTRY_ERROR


def test_normals_come_out_in_the_frames_of_their_slots(memory, camera):
    """The slots of a second set of axes follow those of the first. Positions are the same in both."""
    frame = rotation((0.3, -0.4, 1), 0.7)
    motion = Motion.of(memory, camera, SIZE, AXIS, normal_axes=[np.eye(3), frame])
    for angle in (0, 700, 3000):
        matrices = [motion.matrix(slot, angle) for slot in (0, 1)]
        turn = rotation(AXIS, Motion.radians(angle))
        for axes, matrix in zip((np.eye(3), frame), matrices, strict=True):
            assert np.abs(matrix.normal * 2.0**-16 - axes @ turn).max() <= Motion.ENTRY_ERROR
        np.testing.assert_array_equal(matrices[0].position, matrices[1].position)
        np.testing.assert_array_equal(matrices[0].offset, matrices[1].offset)


def test_the_axis_turns_anticlockwise():
    np.testing.assert_allclose(rotation((0, 0, 1), np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_an_orthographic_camera_is_refused(memory):
    camera = Camera((0, 0, 9), (0, 0, 0))
    with pytest.raises(ValueError, match="need a perspective camera"):
        Motion.of(memory, camera, SIZE)


def test_a_camera_too_near_is_refused(memory):
    camera = Camera((0, 1, 9), (0, 1, 0), projection="perspective", near=0.01)
    with pytest.raises(ValueError, match="too near to a mesh"):
        Motion.of(memory, camera, SIZE)


def test_the_memory_holds_the_mesh(memory):
    mesh, stored = teapot(300), memory.world(memory.parts[0])
    half = np.ptp(mesh.vertices, axis=0).max() / 2
    assert np.abs(stored.vertices - mesh.vertices).max() <= half * 2.0**-18 * 1.001
    assert np.degrees(np.arccos(np.clip((stored.normals * mesh.normals).sum(axis=1), -1, 1))).max() < 0.002
    np.testing.assert_array_equal(stored.faces, mesh.faces)


def test_the_memory_holds_colours_and_texture_coordinates():
    """Coordinates stand for texels of the material's image. A vertex of two materials is stored twice."""
    rng = np.random.default_rng(3)
    faces = [[0, 1, 2], [2, 1, 3], [1, 2, 3]]
    looks = {"colors": rng.random((4, 3)), "coordinates": rng.uniform(-1.5, 2.5, (4, 2))}
    mesh = Mesh(rng.normal(size=(4, 3)), faces, normalise(rng.normal(size=(4, 3))), [0, 0, 1], **looks)
    images = {0: Texture(np.ones((16, 64, 3))), 1: Texture(np.ones((2, 2, 3)), wrap=("mirror", "repeat"))}
    found = MeshMemory.of([mesh], AttributeSpans(True, True), images)
    assert found.vertices == 7
    assert found.placement.shape == (2, 3)
    given = found.attributes / (SurfaceWords.LARGEST * 2**17)
    for _, first, count in found.parts[0].draws:
        kind = int(first > 0)
        corners, own = found.faces[first : first + count], mesh.faces[mesh.material == kind]
        *base, reach = found.placement[kind]
        np.testing.assert_allclose(given[corners][..., :3], mesh.colors[own], atol=2.0**-17)
        texels = base + given[corners][..., 3:] * 2.0**reach
        wanted = mesh.coordinates[own] * images[kind].size
        # Images that repeat are equal after 2048 texels.
        assert np.abs((texels - wanted + 1024) % 2048 - 1024).max() <= 2.0 ** (reach - 17)
    far, wide = (replace(mesh, coordinates=looks["coordinates"] * scale + moved) for scale, moved in MOVED)
    clamped = {0: replace(images[0], wrap=("clamp", "clamp"))}
    with pytest.raises(ValueError, match="material 0 is over 1984 texels from the border"):
        MeshMemory.of([far], AttributeSpans(False, True), clamped)
    with pytest.raises(ValueError, match="material 0 crosses over 4096 texels"):
        MeshMemory.of([wide], AttributeSpans(False, True), images)


def test_block_rams_by_hand():
    """The counts are 512 words of 36 bits, and 640 x 16 words of 27 bits in blocks of 2048 x 9."""
    assert [block_rams(512, 36), block_rams(513, 18), block_rams(10240, 27)] == [1, 1, 15]
    assert MeshMemory.triangles_that_fit(0, 137) == 0
    few, more = (MeshMemory.triangles_that_fit(blocks, 137) for blocks in (10, 20))
    assert 800 < few < more


def test_room_in_the_same_block_rams():
    """1,024 words of 18 bits or 512 words of 36 bits fit a block RAM. At most 4,095 words are counted."""
    mesh = teapot(1000)
    memory = MeshMemory.of([mesh])
    assert (memory.vertices, memory.triangles) == (530, 992)
    assert memory.largest_room(137) == (1024, 1024)
    assert replace(memory, room=(1024, 1024)).largest_room(137) == (1024, 1024)
    assert replace(memory, room=(1024, 1024)).blocks(137) == memory.blocks(137)
    few = MeshMemory.of([teapot(64)])
    assert few.largest_room(137) == (512, 512)
    assert replace(few, room=(3600, 3600)).largest_room(137) == (4095, 4095)


def test_too_many_triangles_are_refused():
    mesh = teapot(10_000)
    with pytest.raises(ValueError, match="holds 1 to 4095 vertices"):
        MeshMemory.of([mesh])
