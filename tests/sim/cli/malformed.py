"""Malformed meshes, scene files and options, and a program that tries them one by one.

``python malformed.py FOLDER SEED COUNT EVERY`` tries ``COUNT`` files and every ``EVERY``-th option, each in a
process forked from itself that has ten seconds of the processor, a minute in all, and a gibibyte more than it
begins with, and prints a line of JSON for each.
"""

import base64
import contextlib
import gc
import io
import itertools
import json
import math
import os
import random
import resource
import shutil
import signal
import struct
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import click
import numpy as np
import trimesh

import blysk.sim.api.render
import blysk.sim.cli.main
from blysk.golden.frames.frame import model_frame
from blysk.sim.frames.frame import SimulatedFrame
from blysk.sim.value_types import OutputFile

MEMORY = 1 << 30
SECONDS = 10
PATIENCE = 60


@dataclass(frozen=True)
class Case:
    """Arguments of the command line, and the files that they find.

    Parameters
    ----------
    name : str
        What is wrong.
    arguments : list of str
        Of `main`.
    files : dict
        Bytes by name; ``None`` makes a folder, a text a link to it, `os.mkfifo` a pipe. A name that starts
        with ``../`` lies outside of the working folder.
    must_fail : bool
        Whether it must be refused; else it may be valid by chance.
    """

    name: str
    arguments: list[str]
    files: dict[str, Any] = field(default_factory=dict)
    must_fail: bool = False


# Good files.

_VERTICES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], "<f4")
_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], "<u4"
)

_LIBRARY = b"newmtl red\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 40\nmap_Kd a.png\nnewmtl blue\nKd 0.1 0.1 0.8\n"

_SCENE = b"""# A scene.
size = [16, 12]
background = "#1a1c20"
ambient_light = [1, 0.9, 0.8]
back_faces = "flip"
[mesh]
file = "a.stl"
crease = 40
materials = "file"
[camera]
projection = "perspective"
position = [3, 2, 4]
target = [0, 0.1, 0]
up = [0, 1, 0]
field_of_view = 30
viewer = "near"
[[lights]]
direction = [-0.5, 0.8, 0.7]
color = [1, 1, 1]
[[lights]]
position = [2, 3, 4]
color = "#405060"
[material]
ambient = [0.08, 0.05, 0.03]
diffuse = [0.75, 0.42, 0.2]
specular = 0.6
exponent = 50
[pipeline]
method = "chord-local"
model = "cosquad"
setup_interval = 4
gate = false
short_words = false
"""


def _obj() -> bytes:
    lines = ["# An octahedron.", "mtllib a.mtl"]
    lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in _VERTICES]
    lines += [f"vn {x:g} {y:g} {z:g}" for x, y, z in _VERTICES]
    lines += ["vt 0 0", "vt 1 0.5"]
    for number, face in enumerate(_FACES + 1):
        lines += [f"usemtl {'red' if number < 4 else 'blue'}"] * (number % 4 == 0)
        lines.append("f " + " ".join(f"{k}/1/{k}" for k in face))
    return ("\n".join(lines) + "\n").encode()


def document_of(uri: str | None) -> tuple[dict, bytes]:
    """A glTF document of two nodes, and its buffer."""
    views = [_VERTICES.tobytes(), _VERTICES.tobytes(), _FACES.tobytes()]
    offsets = np.cumsum([0, *map(len, views)]).tolist()
    buffer = {"byteLength": offsets[-1]} | ({"uri": uri} if uri else {})
    attributes = {"POSITION": 0, "NORMAL": 1}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"mesh": 0, "children": [1]},
            {"mesh": 0, "translation": [0.5, 0, 0], "scale": [0.5, 0.5, 0.5]},
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.1, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": 24, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": begin, "byteLength": end - begin}
            for begin, end in itertools.pairwise(offsets)
        ],
        "buffers": [buffer],
    }
    return document, b"".join(views)


def glb(document: Any, buffer: bytes) -> bytes:
    """A GLB file."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def _gltf(uri: str = "a.bin") -> dict[str, bytes]:
    document, buffer = document_of(uri)
    return {"a.gltf": json.dumps(document, indent=1).encode(), "a.bin": buffer}


def _data_gltf() -> dict[str, bytes]:
    buffer = document_of(None)[1]
    data = base64.b64encode(buffer).decode()
    document, _ = document_of(f"data:application/octet-stream;base64,{data}")
    return {"a.gltf": json.dumps(document).encode()}


def good_files() -> dict[str, dict[str, bytes]]:
    """By kind, the files of a good mesh or scene, the one to be named first."""
    mesh = trimesh.Trimesh(_VERTICES, _FACES, vertex_normals=_VERTICES, process=False)
    stl = mesh.export(file_type="stl")
    return {
        "obj": {"a.obj": _obj(), "a.mtl": _LIBRARY},
        "mtl": {"a.obj": _obj(), "a.mtl": _LIBRARY},
        "stl": {"a.stl": stl},
        "ascii stl": {"a.stl": mesh.export(file_type="stl_ascii").encode()},
        "ply": {"a.ply": mesh.export(file_type="ply", vertex_normal=True)},
        "ascii ply": {"a.ply": mesh.export(file_type="ply", vertex_normal=True, encoding="ascii")},
        "glb": {"a.glb": glb(*document_of(None))},
        "gltf": _gltf(),
        "gltf with data": _data_gltf(),
        "scene": {"a.toml": _SCENE, "a.stl": stl},
    }


# Damage.


def _split(text: str) -> list[str]:
    return text.split("|")


_NUMBERS = _split("nan|inf|-inf|1e400|1e308|1e-320|-1|-0|0|6|0x10|1_0|٣|1,5|--1|1.2.3|1000000000|2147483648")
_NUMBERS = [word.encode() for word in [*_NUMBERS, "9" * 20]]
_WORDS = _split("f|v|list|usemtl|end_header|teapot|../a.stl|/dev/zero|#|{|[[|ż|\u202e|\\||\0|\r|\"|'''")
_WORDS = [*(word.encode() for word in _WORDS), b"\xff\xfe", b"a" * 5000]
_FLOATS = [float("nan"), float("inf"), -float("inf"), 3e38, -3e38, 1e-45, 0.0]
_VALUES = [None, True, -1, 0, 1, 10**9, 2**31, 2**63, 10**30, 1.5, 1e308, float("nan"), float("inf")]
_VALUES += [
    "",
    "x",
    "\0",
    "ż",
    [],
    {},
    [[]],
    [None],
    "../secret.bin",
    "/etc/passwd",
    "http://localhost/a.bin",
]


def _truncated(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def _flipped(data: bytes, rng: random.Random) -> bytes:
    damaged = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 5, 30])):
        damaged[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def _overwritten(data: bytes, rng: random.Random) -> bytes:
    at, length = rng.randrange(len(data)), rng.choice([1, 4, 16, 64])
    filling = rng.choice([bytes(length), b"\xff" * length, rng.randbytes(length), b" " * length])
    return data[:at] + filling + data[at + length :]


def _shifted(data: bytes, rng: random.Random) -> bytes:
    """A piece left out, doubled or put in."""
    at, length = rng.randrange(len(data)), rng.choice([1, 3, 20, 200])
    return rng.choice(
        [
            data[:at] + data[at + length :],
            data[: at + length] + data[at:],
            data[:at] + rng.randbytes(length) + data[at:],
            data + data[at : at + length],
        ]
    )


def _counted(data: bytes, rng: random.Random) -> bytes:
    """A word of the binary part, a count perhaps, made huge."""
    at = rng.choice([8, 12, 80, 4 * rng.randrange(max(1, len(data) // 4))])
    value = rng.choice([10**9, 2**31 - 1, 2**31, 2**32 - 1, 0, 1])
    return data[:at] + struct.pack("<I", value) + data[at + 4 :]


def _unreal(data: bytes, rng: random.Random) -> bytes:
    """A word made a float that is none, or huge."""
    at = len(data) % 4 + 4 * rng.randrange(max(1, len(data) // 4))
    return data[:at] + struct.pack("<f", rng.choice(_FLOATS)) + data[at + 4 :]


def _reworded(data: bytes, rng: random.Random, odd: list[bytes], is_chosen: Callable[[bytes], bool]) -> bytes:
    pieces = data.replace(b"\n", b" \n ").split(b" ")
    places = [k for k, piece in enumerate(pieces) if is_chosen(piece)]
    if places:
        pieces[rng.choice(places)] = rng.choice(odd)
    return b" ".join(pieces)


def _renumbered(data: bytes, rng: random.Random) -> bytes:
    return _reworded(data, rng, _NUMBERS, lambda piece: piece.strip(b"[],-.").isdigit())


def _misspelt(data: bytes, rng: random.Random) -> bytes:
    return _reworded(data, rng, _WORDS, lambda piece: piece not in (b"", b"\n"))


def _reordered(data: bytes, rng: random.Random) -> bytes:
    """Lines shuffled, left out, doubled."""
    lines = data.split(b"\n")
    for _ in range(rng.choice([1, 1, 3])):
        at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        if rng.random() < 0.5:
            lines[at], lines[other] = lines[other], lines[at]
        else:
            lines[at : at + 1] = rng.choice([[b""], [lines[at]] * 2, [lines[at]] * 1000])
    return b"\n".join(lines)


def _encoded(data: bytes, rng: random.Random) -> bytes:
    text = data.decode("latin-1")
    return rng.choice(
        [
            text.encode("utf-16"),
            b"\xef\xbb\xbf" + data,
            data.replace(b"\n", b"\r"),
            data.replace(b"\n", b"\r\n"),
            data.replace(b"\n", b" "),
            data.replace(b" ", "\u00a0".encode()),
            data.upper(),
        ]
    )


_DAMAGE = [_truncated, _flipped, _flipped, _overwritten, _shifted]
_BINARY = [*_DAMAGE, _counted, _unreal, _unreal]
_TEXT = [*_DAMAGE, _renumbered, _renumbered, _misspelt, _misspelt, _reordered, _encoded]


def _paths(value: Any, path: tuple = ()) -> Iterator[tuple]:
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from _paths(item, (*path, key))


def _at(value: Any, path: tuple) -> Any:
    for key in path:
        value = value[key]
    return value


def _mutated_document(document: dict, rng: random.Random) -> dict:
    """A value of a document replaced by an odd one, or by another of it, or left out."""
    document = json.loads(json.dumps(document))
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        *above, key = rng.choice([path for path in _paths(document) if path])
        parent = _at(document, above)
        if rng.random() < 0.2:
            del parent[key]
        elif rng.random() < 0.3:
            parent[key] = json.loads(json.dumps(_at(document, rng.choice(list(_paths(document))))))
        else:
            parent[key] = rng.choice(_VALUES)
    return document


# Cases.

_RENDER = ["--size", "16x12"]


def _damaged_file(rng: random.Random) -> Case:
    """A good file with one to three damages."""
    kind, files = rng.choice(list(good_files().items()))
    main = next(iter(files))
    damaged = {"mtl": "a.mtl", "gltf": rng.choice(["a.gltf", "a.bin"])}.get(kind, main)
    is_text = kind not in ("stl", "ply", "glb") and damaged != "a.bin"
    data, names = files[damaged], []
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        damage = rng.choice(_TEXT if is_text or rng.random() < 0.2 else _BINARY)
        data = damage(data, rng) or b"\0"
        names.append(damage.__name__[1:])
    options = [] if kind == "scene" else _RENDER
    return Case(f"{kind}: {', '.join(names)}", ["render", main, *options], {**files, damaged: data})


def _damaged_document(rng: random.Random) -> Case:
    """A glTF document with odd values."""
    if rng.random() < 0.5:
        document, buffer = document_of(None)
        files = {"a.glb": glb(_mutated_document(document, rng), buffer)}
    else:
        document, buffer = document_of("a.bin")
        files = {"a.gltf": json.dumps(_mutated_document(document, rng)).encode(), "a.bin": buffer}
    return Case("glTF document", ["render", next(iter(files)), *_RENDER], files)


def _outside(rng: random.Random) -> Case:
    """A reference that leaves the folder; what it would find is good."""
    name = rng.choice(
        _split(
            "../secret.bin|sub/../../secret.bin|%2e%2e/secret.bin|..%2Fsecret.bin|link.bin|sub/link/secret.bin|"
            "file:../secret.bin|http://localhost:1/secret.bin|//localhost/secret.bin|C:\\secret.bin|/dev/zero|"
            "/proc/self/mem"
        )
    )
    files = {"../secret.bin": document_of(None)[1], "../secret.mtl": _LIBRARY, "sub": None}
    files["sub/link"] = "../.."
    main = rng.choice(["a.obj", "a.gltf", "a.toml"])
    if main == "a.obj":
        name = name.replace(".bin", ".mtl").replace("%2e", ".").replace("%2F", "/")
        files |= {"a.obj": _obj().replace(b"a.mtl", name.encode()), "link.mtl": "../secret.mtl"}
    else:
        files |= {**_gltf(name), "link.bin": "../secret.bin"}
        files |= {"a.toml": _SCENE.replace(b"a.stl", b"a.gltf")}
    return Case(f"outside: {name}", ["render", main, *_RENDER], files, must_fail=True)


def _inside_but_odd(rng: random.Random) -> Case:
    """References that stay inside, to what cannot be read as a file."""
    files = _gltf(rng.choice(["folder", "pipe", "loop", "missing.bin", "", ".", "a.gltf", "\0", "x" * 300]))
    files |= {"folder": None, "pipe": os.mkfifo, "loop": "loop"}
    return Case("odd reference", ["render", "a.gltf", *_RENDER], files, must_fail=True)


def _nodes(rng: random.Random) -> Case:
    """Nodes in a circle, in a long row, or doubled at every step."""
    kind = rng.choice(["self", "two", "long", "doubled", "circle below", "many roots", "shared"])
    document, buffer = document_of(None)
    row = rng.choice([30, 2000, 50_000])
    nodes = {
        "self": [{"mesh": 0, "children": [0]}],
        "two": [{"mesh": 0, "children": [1]}, {"mesh": 0, "children": [0]}],
        "long": [*({"children": [k + 1]} for k in range(row)), {"mesh": 0}],
        "doubled": [*({"children": [k + 1, k + 1]} for k in range(30)), {"mesh": 0}],
        "circle below": [{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [1], "mesh": 0}],
        "many roots": [{"mesh": 0} for _ in range(row // 10)],
        "shared": [{"children": [2, 1]}, {"children": [2]}, {"mesh": 0}],
    }[kind]
    if kind == "doubled" and rng.random() < 0.5:
        # Two nodes a level, each the parent of both below.
        nodes = [{"children": [k + 2 - k % 2, k + 3 - k % 2]} for k in range(60)] + [{"mesh": 0}] * 2
    document["nodes"] = nodes
    if kind == "many roots":
        document["scenes"] = [{"nodes": list(range(len(nodes)))}]
    must_fail = kind not in ("many roots", "long")
    files = {"a.glb": glb(document, buffer)}
    return Case(f"nodes: {kind} {row}", ["render", "a.glb", *_RENDER], files, must_fail)


def _huge_header(rng: random.Random) -> Case:
    """A header that promises a thousand million of something."""
    count = rng.choice([10**9, 2**31 - 1, 2**31, 2**32 - 1, 10**12, 10**18, 2**63, 10**30])
    good, kind = good_files(), rng.choice(["ply", "ascii ply", "stl", "count", "length", "glb", "no view"])
    if kind in ("ply", "ascii ply"):
        old, new = rng.choice([(b"vertex 6", b"vertex %d" % count), (b"face 8", b"face %d" % count)])
        files = {"a.ply": good[kind]["a.ply"].replace(old, new)}
    elif kind == "stl":
        files = {"a.stl": bytes(80) + struct.pack("<I", count % 2**32 or 10**9) + bytes(rng.choice([0, 50]))}
    else:
        document, buffer = document_of(None)
        part = rng.choice(document["accessors"])
        if kind == "count":
            part["count"] = count
        elif kind == "no view":
            part["count"] = min(count, 3 * 10**7)
            del part["bufferView"]
        elif kind == "length":
            rng.choice(document["bufferViews"])["byteLength"] = count
        data = glb(document, buffer)
        if kind == "glb":
            at = rng.choice([8, 12])
            data = data[:at] + struct.pack("<I", count % 2**32 or 10**9) + data[at + 4 :]
        files = {"a.glb": data}
    # A view that is longer than the buffer may be cut to it, and hold what the accessor needs.
    must_fail = kind != "length"
    return Case(f"header: {kind} {count}", ["render", next(iter(files)), *_RENDER], files, must_fail)


def _long_text(rng: random.Random) -> Case:
    """Little that is read over and over, or nested."""
    kind = rng.choice(["spaces", "corners", "tabs", "nested", "materials", "dots", "continued", "digits"])
    obj = _obj()
    texts = {
        "spaces": obj + b" " * 200_000 + b"\n",
        "corners": obj + b"f" + b" 1" * 100_000 + b"\n",
        "tabs": obj.replace(b" ", b"\t" * 3000),
        "dots": obj + b"." * 300_000,
        "continued": obj + b"\\\n" * 100_000,
        "digits": obj + b"v " + b"9" * 200_000 + b" 0 0\n",
    }
    if kind in texts:
        files = {"a.obj": texts[kind], "a.mtl": _LIBRARY}
    elif kind == "nested":
        files = {"a.gltf": b'{"a":' + rng.choice([b"[" * 100_000, b'{"a":' * 100_000])}
    else:
        lines = b"".join(b"usemtl m%d\nf 1 2 3\n" % k for k in range(5000))
        library = b"".join(b"newmtl m%d\nNs %d\n" % (k, k) for k in range(5000))
        files = {"a.obj": obj + lines, "a.mtl": library}
    return Case(f"long: {kind}", ["render", next(iter(files)), *_RENDER], files)


def _odd_name(rng: random.Random) -> Case:
    """A good file under an odd name."""
    stems = _split(
        "зображення|🫖|a\u202eb|a\u0301|\udcff|-o|%41|{x}|$HOME|.|'|\"|\\|*|a;b|\x1b[31m|\x7f|CON|~"
    )
    stem = rng.choice([*stems, "", " ", "a b", "a\nb", "a\tb", "\u2028", "a" * 250])
    kind = rng.choice(["obj", "stl", "ply", "glb", "scene"])
    files = good_files()[kind]
    suffix = Path(next(iter(files))).suffix
    name = f"{stem}{suffix}"
    files = {name: next(iter(files.values())), "a.stl": good_files()["stl"]["a.stl"]}
    return Case(f"name: {name!r}", ["render", *_RENDER, "--", name], files)


def _no_file(rng: random.Random) -> Case:
    """Something else than a file."""
    name = "a" + rng.choice([".obj", ".stl", ".ply", ".glb", ".gltf", ".toml"])
    content = rng.choice([None, os.mkfifo, name, "missing", "/dev/zero", "/dev/null", "/proc/self/mem", b""])
    shown = "folder" if content is None else getattr(content, "__name__", content)
    return Case(f"no file: {shown}", ["render", name, *_RENDER], {name: content}, must_fail=True)


_KINDS = {
    _damaged_file: 50,
    _damaged_document: 15,
    _outside: 8,
    _inside_but_odd: 3,
    _nodes: 5,
    _huge_header: 7,
    _long_text: 3,
    _odd_name: 5,
    _no_file: 4,
}


def file_case(seed: int, index: int) -> Case:
    """Number ``index`` of the malformed files."""
    rng = random.Random(f"{seed} {index}")
    return rng.choices(list(_KINDS), list(_KINDS.values()))[0](rng)


# Options.

_LONG = "x" * 10_000
_ODD = [*_split("| |\n|a\nb|ż🫖|\udcff|\x1b[31m|x|None|--"), _LONG]
_BAD_NUMBERS = [*_split("|nan|inf|-inf|1.5|1e3|0x10|٣|-1|1_0| 1|1\n"), "9" * 30, _LONG]
_BAD_VECTORS = _split("|1,2|1,2,3,4|1,2,nan|inf,0,0|1e400,0,0|a,b,c|1;2;3|,,|1,,2|1\n2|1,2,3,|1,2,3,4,5|ż")
_BAD_COLORS = _split("|#12345|#gggggg|#1234567|1,1|-0.1|1.1|nan|inf,0,0|red|1,1,1,1|1\n2")
_BAD_FILES = [*_split(".|folder{0}|nowhere/a{0}|file/a{0}|a\n/b{0}|\udcff/b{0}"), "x" * 300 + "{0}"]
_BAD_FOLDERS = [*_split("file|nowhere/folder|file/folder|a\n/b"), "x" * 300]
_BAD_MESHES = _split("|.|..|/|folder|nowhere.obj|file|file/a.obj|/dev/zero|a\nb.obj|\udcff.obj|teapot/")
_BAD_MESHES += ["/proc/self/mem", "https://localhost/a.obj", "x" * 300 + ".obj", _LONG]
_BAD_ADDRESSES = [*_split("|x|tcp://|http://a:1|a b:1|ż|a\nb|tcp://a:b|tcp://[x]:1"), _LONG]

_OF_TYPE = {
    "Whole": _BAD_NUMBERS,
    "_Count": _BAD_NUMBERS,
    "_Error": [*_split("|nan|inf|0|-1|256|x|1,5|ż|1\n2"), _LONG],
    "Size": [*_split("|16|16x|x12|0x0|-1x5|16x12x3|4096x1|1e3x5|16X12|nanx1|٣x٣"), _LONG],
    "Number": [*_split("|x|nan|inf|-1|1,2|ż|1e999"), _LONG],
    "Vector": [*_BAD_VECTORS, "," * 5000, _LONG],
    "Color": [*_BAD_COLORS, _LONG],
    "Choice": [*_ODD, "1", "LINEAR", "linear,chord"],
    "_Some": [*_ODD, ",", "linear,,chord", "1.5", "17,x"],
    "Path": _BAD_FOLDERS,
    "BoolParamType": ["x", ""],
}
_OF_NAME = {
    "folder": _BAD_FOLDERS,
    "mesh": _BAD_MESHES,
    "meshes": _BAD_MESHES,
    "address": _BAD_ADDRESSES,
    "devices": _ODD,
    "name": _split("| |\n|a\nb|ż🫖|\udcff|\x1b[31m|--|1a|a b|a-b"),
}
_SUFFIXES = {"output": ".png", "comparison": ".png", "figures": ".json", "vcd": ".vcd"}


def _bad_values(option: click.Parameter) -> list[str]:
    if option.name in _SUFFIXES:
        values = [value.format(_SUFFIXES[option.name]) for value in _BAD_FILES]
        return ["", *values] if isinstance(option.type, OutputFile) else values
    return _OF_NAME.get(option.name) or _OF_TYPE.get(type(option.type).__name__, _ODD)


def option_cases() -> Iterator[Case]:
    """Bad values of every option and argument of every command."""
    files = {"file": b"x", "folder": None, **{f"folder{suffix}": None for suffix in _SUFFIXES.values()}}
    context = click.Context(blysk.sim.cli.main.cli)
    for word in blysk.sim.cli.main.cli.list_commands(context):
        command = blysk.sim.cli.main.cli.get_command(context, word)
        begin = [word, "teapot"] if word == "render" else [word]
        for option in command.params:
            for value in _bad_values(option):
                if isinstance(option, click.Option):
                    arguments = [*begin, f"{max(option.opts, key=len)}={value}"]
                else:
                    arguments = [word, "--", value]
                name = f"{word} {option.opts[0]} {value[:20]!r}"
                yield Case(name, arguments, files, must_fail=True)
        for wrong in (["--nothing"], ["--no\nthing"], ["--json"], ["one", "two", "three"]):
            yield Case(f"{word} {wrong[0]!r}", [*begin, *wrong], files, must_fail=True)
    for value in [*_ODD, "-x", "--no\nthing"]:
        yield Case(f"command {value[:20]!r}", [value], files, must_fail=True)


# The program.


def _put(folder: Path, files: dict[str, Any]) -> None:
    for name, content in files.items():
        path = folder / name
        if content is None:
            path.mkdir()
        elif isinstance(content, str):
            path.symlink_to(content)
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            content(path)


def _listing(folder: Path) -> dict[str, Any]:
    """What is in a folder, by name: size and time of change."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        is_file = path.is_file() and not path.is_symlink()
        found[str(path.relative_to(folder))] = (status.st_size, status.st_mtime_ns) if is_file else None
    return found


def _memory(field: str) -> int:
    """Bytes of address space that this process has, or had at most."""
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.partition(f"{field}:")[2].split()[0])


def _attempt(case: Case, folder: Path, output: Path) -> None:
    """In a process of its own: run the command line, and end with its status; 99 where it raised."""
    status = 99
    try:
        for name, number in (("out", 1), ("err", 2)):
            os.dup2(os.open(output / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), number)
        os.chdir(folder)
        begin = _memory("VmSize")
        resource.setrlimit(resource.RLIMIT_AS, (begin + MEMORY,) * 2)
        used = sum(os.times()[:2])
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(used) + SECONDS,) * 2)
        signal.alarm(PATIENCE)
        status = blysk.sim.cli.main.main(case.arguments)
        sys.stdout.flush()
        (output / "memory").write_text(str(_memory("VmPeak") - begin))
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(status)


def attempt(case: Case, root: Path) -> dict[str, Any]:
    """What the command line does about a case: its status, what it says, takes and leaves behind."""
    folder, output = root / "outside" / "folder", root / "output"
    for path in (folder.parent, output, Path(tempfile.gettempdir())):
        shutil.rmtree(path, ignore_errors=True)
        path.mkdir()
    folder.mkdir()
    _put(folder, case.files)
    places = (folder.parent, Path(tempfile.gettempdir()))
    before = [_listing(place) for place in places]
    start = perf_counter()
    process = os.fork()
    if not process:
        _attempt(case, folder, output)
    _, status = os.waitpid(process, 0)
    seconds = perf_counter() - start
    after = [_listing(place) for place in places]
    changed = [
        name.removeprefix("folder/")
        for old, new in zip(before, after, strict=True)
        for name in sorted(old.keys() | new.keys())
        if old.get(name, "") != new.get(name, "") and name != "folder"
    ]
    memory = output / "memory"
    return {
        "name": case.name,
        "must_fail": case.must_fail,
        "status": os.waitstatus_to_exitcode(status),
        "says": (output / "err").read_text(errors="surrogateescape"),
        "prints": len((output / "out").read_bytes()),
        "changed": changed,
        "seconds": seconds,
        "memory": int(memory.read_text()) if memory.exists() else None,
    }


def _simulate_by_model() -> None:
    """Draw by the bit-accurate model: what is tried is what comes before the pipeline, and behind it."""

    class Stub:
        def __init__(self, design, *_):
            self.design = design

        def render(self, scene, progress=None, vcd=None):
            frame = model_frame(scene, self.design)
            seconds = {"raster": 1.0, "simulate": 1.0}
            return SimulatedFrame(**vars(frame) | {"seconds": seconds}, cycles=1, engine="model")

    blysk.sim.api.render.FrameSimulator = Stub


def _warm_up(root: Path, cases: list[Case]) -> None:
    """Import and look up, before the processes are forked, what each of them would."""
    folder = root / "first"
    folder.mkdir()
    here = os.getcwd()
    os.chdir(folder)
    for case in cases:
        _put(folder, {name: content for name, content in case.files.items() if not Path(name).exists()})
        with contextlib.redirect_stdout(io.StringIO()):
            assert blysk.sim.cli.main.main(case.arguments) == 0
    os.chdir(here)
    gc.freeze()


def run(root: Path, seed: int, count: int, every: int) -> None:
    """Try the good files, malformed files and bad options, and print what came of each."""
    _simulate_by_model()
    # The hardest: names come out of it in some form all the same.
    sys.stdout.reconfigure(encoding="ascii")
    for path in (root / "temporary", root / "cache"):
        path.mkdir(mode=0o700)
    os.environ["TMPDIR"] = str(root / "temporary")
    os.environ["BLYSK_CACHE"] = str(root / "cache")
    tempfile.tempdir = None
    # The commands' modules are imported once, here.
    options = list(option_cases())[::every]
    good = [
        Case(f"good {kind}", ["render", next(iter(files)), *_RENDER], files)
        for kind, files in good_files().items()
    ]
    _warm_up(root, good)
    files = [file_case(seed, index) for index in range(count)]
    for case in [*good, *files, *options]:
        print(json.dumps(attempt(case, root)), flush=True)


if __name__ == "__main__":
    run(Path(sys.argv[1]), *map(int, sys.argv[2:]))
