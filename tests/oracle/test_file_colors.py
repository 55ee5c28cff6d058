"""Colours of OBJ, PLY and STL files: files and values by trimesh or by hand, pictures by the ray caster."""

import struct

import numpy as np
import pytest
import trimesh

import blysk
from blysk.golden.reference.renderer import render

from .caster import Paint, cast
from .test_frames import SURE, view_of

SIZE = 96, 72
AMBIENT = 0.75


def ball():
    """A ball of 80 triangles whose vertices have random codes of sRGB.

    Coordinates are under 1, and the largest is over 1/2.
    """
    made = trimesh.creation.icosphere(1, 0.75)
    codes = np.random.default_rng(3).integers(0, 256, (len(made.vertices), 4))
    codes[:, 3] = 255
    made.visual.vertex_colors = codes.astype(np.uint8)
    return made


def by_trimesh(path, **options):
    """A file that trimesh writes, and the data that trimesh reads from it: vertices, faces, codes of
    vertices."""
    ball().export(path, **options)
    read = trimesh.load(path, process=False)
    return read.vertices, read.faces, read.visual.vertex_colors[:, :3] / 255


def stl(path):
    """A binary file with a colour of 5 bits a channel for each facet, red in the highest bits."""
    corners = ball().triangles.astype("<f4")
    levels = np.random.default_rng(4).integers(0, 32, (len(corners), 3))
    rows = [
        struct.pack("<12fH", 0, 0, 0, *triangle.ravel().tolist(), 1 << 15 | r << 10 | g << 5 | b)
        for triangle, (r, g, b) in zip(corners, levels.tolist(), strict=True)
    ]
    path.write_bytes(bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows))
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return corners.reshape(-1, 3).astype(float), faces, np.repeat(levels / 31, 3, axis=0)


@pytest.mark.parametrize(
    ("name", "write", "options"),
    [
        ("a.ply", by_trimesh, {"encoding": "ascii"}),
        ("a.ply", by_trimesh, {"encoding": "binary"}),
        ("a.obj", by_trimesh, {"include_color": True, "digits": 12}),
        ("a.stl", stl, {}),
    ],
    ids=["PLY, text", "PLY, binary", "OBJ", "STL"],
)
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_colours_of_files(tmp_path, name, write, options, projection):
    vertices, faces, codes = write(tmp_path / name, **options)
    look = {"projection": projection, "view": (0.4, 0.3, 1), "size": SIZE}
    # Without a light the picture is the albedo.
    scene = blysk.scene(tmp_path / name, **look, lights="0,0,1,0,0,0", ambient=AMBIENT)
    colors = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    coefficients = (AMBIENT,) * 3, (0.0,) * 3, (0.0,) * 3
    given = vertices, faces, vertices, view_of(scene), (0, 0, 1), coefficients, 1, "blinn"
    seen = cast(*given, steps=256, paint=Paint(faces, colors))
    frame = render(scene)
    sure = seen.hit & (seen.margin > SURE)
    assert sure.sum() > 0.9 * frame.mask.sum() > 1000
    # From texts trimesh keeps numbers of single precision.
    assert np.abs(255 * frame.image - seen.color)[sure].max() < 1e-4
    assert np.ptp(seen.color[sure], axis=0).min() > 100
