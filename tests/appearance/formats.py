"""OBJ, PLY and STL files with colours, made by code: a name, the files, what they show, and how to look.

Coordinates are as in `SAMPLES`. VTK draws what the sample says, and reads no file.
"""

import struct
from typing import Any, NamedTuple

import numpy as np

from .samples import BOX, BOX_FACES, PLACES, SQUARE, noise, picture


class Shape(NamedTuple):
    """The surface that a file shows, without light."""

    vertices: Any
    faces: Any
    colors: Any = None
    """Linear light of the vertices."""
    image: Any = None
    """Codes of the image, and the texture coordinates of the vertices, v up."""
    places: Any = None
    color: tuple = (1, 1, 1)
    """Linear light of the surface, which the image multiplies."""


class Known(NamedTuple):
    """A file of another format with its companions by name, and the surface that it shows."""

    files: dict
    shape: Shape

    def write(self, folder):
        """Write the files; the path of the first."""
        for name, data in self.files.items():
            (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        return folder / next(iter(self.files))

    def for_vtk(self, folder):
        """The surface that VTK draws."""
        return self.shape


def linear(codes, whole=255):
    """Linear light of codes, by the curve of sRGB (IEC 61966-2-1)."""
    codes = np.asarray(codes) / whole
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


WHITE = {"ambient": 1, "diffuse": 1, "specular": 0, "lights": []}
"""Options that show colours as they are."""


def codes_of(count, whole=255):
    """Codes of sRGB. VTK keeps 8 bits of linear light, so dark codes are 0."""
    codes = np.random.default_rng(8).integers(0, whole + 1, (count, 3))
    return np.where(codes < 0.6 * whole, 0, codes)


def obj_colors(whole):
    """Colours behind positions, from 0 to 1 or from 0 to 255."""
    codes = codes_of(8)
    rows = np.column_stack([BOX, codes if whole == 255 else codes / 255]).tolist()
    text = "".join(f"v {' '.join(map(repr, row))}\n" for row in rows)
    text += "".join(f"f {' '.join(str(k + 1) for k in face)}\n" for face in BOX_FACES)
    return Known({"sample.obj": text}, Shape(BOX, BOX_FACES, linear(codes))), dict(WHITE)


def obj_image():
    """An image of a material, scaled and moved. Each corner of both triangles has its own coordinates."""
    image, scale, offset = noise(4, 8), np.array([1.5, -0.75]), np.array([0.25, 0.1])
    corners = SQUARE[[0, 1, 2, 0, 2, 3]]
    places = np.array([[0, 0], [1, 0.1], [0.9, 1], [0.4, 0.2], [1.2, 0.8], [0.3, 1.4]])
    text = "mtllib sample.mtl\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in SQUARE)
    text += "".join(f"vt {u} {v} 0\n" for u, v in places)
    text += "usemtl paper\nf 1/1 2/2 3/3\nf -4/-3 -2/-2 -1/-1\n"
    material = "newmtl paper\nillum 0\nKd .5 .9 .25\nmap_Kd -s 1.5 -.75 1 -o .25 .1 0 my paper.png\n"
    files = {"sample.obj": text, "sample.mtl": material, "my paper.png": picture(image)}
    placed = places * scale + offset
    return Known(files, Shape(corners, np.arange(6).reshape(2, 3), None, image, placed, (0.5, 0.9, 0.25))), {}


def ply_head(form, names, vertices, faces, comment=""):
    """Head of a PLY file whose vertices have further properties."""
    lines = [f"format {form} 1.0", *([comment] if comment else []), f"element vertex {vertices}"]
    lines += [f"property float {name}" for name in "xyz"] + [f"property {name}" for name in names]
    lines += [f"element face {faces}", "property list uchar int vertex_indices", "end_header"]
    return "ply\n" + "\n".join(lines) + "\n"


def ply_colors(form):
    """Colours of 8 bits, in a text or in bytes."""
    codes, points = codes_of(8), BOX.astype(np.float32)
    head = ply_head(form, [f"uchar {name}" for name in ("red", "green", "blue")], 8, 12)
    if form == "ascii":
        rows = [[*place, *code] for place, code in zip(points.tolist(), codes.tolist(), strict=True)]
        rows += [[3, *face] for face in BOX_FACES]
        data = head + "".join(" ".join(map(repr, row)) + "\n" for row in rows)
    else:
        order = ">" if "big" in form else "<"
        rows = [struct.pack(f"{order}3f3B", *place, *code) for place, code in zip(points, codes, strict=True)]
        rows += [struct.pack(f"{order}B3i", 3, *face) for face in BOX_FACES]
        data = head.encode() + b"".join(rows)
    return Known({"sample.ply": data}, Shape(points, BOX_FACES, linear(codes))), dict(WHITE)


def ply_image():
    """An image, and coordinates s and t of the vertices."""
    image, places = noise(4, 8), PLACES[::-1] * [0.8, 1.7] + 0.1
    head = ply_head("ascii", ["float s", "float t"], 4, 2, "comment TextureFile paper.png")
    rows = [*np.column_stack([SQUARE, places]).tolist(), [3, 0, 1, 2], [3, 0, 2, 3]]
    data = head + "".join(" ".join(map(repr, row)) + "\n" for row in rows)
    shape = Shape(SQUARE, [[0, 1, 2], [0, 2, 3]], None, image, places)
    return Known({"sample.ply": data, "paper.png": picture(image)}, shape), dict(WHITE)


def stl_colors(head):
    """Colours of facets with 5 bits a channel: by VisCAM, or by Materialise with the colour of the solid."""
    codes = codes_of(12, 31)
    colors = linear(codes, 31)
    red, green, blue = codes.T
    attributes = 0x8000 | red << 10 | green << 5 | blue
    if head:
        attributes = blue << 10 | green << 5 | red
        attributes[4:8] = 0x8000
        colors[4:8] = linear([255, 200, 0])
    data = head.ljust(80) + struct.pack("<I", 12)
    corners = BOX[BOX_FACES].astype(np.float32)
    for facet, attribute in zip(corners, attributes.tolist(), strict=True):
        data += struct.pack("<12fH", 0, 0, 0, *facet.ravel(), attribute)
    shape = Shape(corners.reshape(-1, 3), np.arange(36).reshape(12, 3), np.repeat(colors, 3, axis=0))
    return Known({"sample.stl": data}, shape), dict(WHITE)


COLORED = {
    **{f"OBJ, colours to {whole}": (obj_colors, (whole,)) for whole in (1, 255)},
    "OBJ, image": (obj_image, ()),
    **{
        f"PLY, colours, {form}": (ply_colors, (form,))
        for form in ("ascii", "binary_little_endian", "binary_big_endian")
    },
    "PLY, image": (ply_image, ()),
    "STL, colours": (stl_colors, (b"",)),
    "STL, colours and solid": (stl_colors, (b"COLOR=\xff\xc8\0\xff",)),
}
"""Of each sample the function that makes it, and what it is given."""
