"""Malformed meshes and scene files: good files with damage, odd names, references, counts and nodes."""

import json
import os
import random
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from good_files import LIBRARY, SCENE, document_of, glb, gltf, good_files, obj


@dataclass(frozen=True)
class Case:
    """Arguments of the command line, and the files that they find.

    Parameters
    ----------
    name : str
        What is wrong.
    arguments : list of str
        Arguments of `main`.
    files : dict
        Content by name: bytes for a file, ``None`` for a folder, a text for a link to this name, `os.mkfifo`
        for a pipe. A file whose name starts with ``../`` is outside of the working folder.
    must_fail : bool
        Whether the case must be refused. A case that need not be refused may be valid by chance.
    """

    name: str
    arguments: list[str]
    files: dict[str, Any] = field(default_factory=dict)
    must_fail: bool = False


def split(text: str) -> list[str]:
    return text.split("|")


_NUMBERS = split("nan|inf|-inf|1e400|1e308|1e-320|-1|-0|0|6|0x10|1_0|٣|1,5|--1|1.2.3|1000000000|2147483648")

_NUMBERS = [word.encode() for word in [*_NUMBERS, "9" * 20]]

_WORDS = split("f|v|list|usemtl|end_header|teapot|../a.stl|/dev/zero|#|{|[[|ż|\u202e|\\||\0|\r|\"|'''")

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
    """A piece is left out, doubled or inserted."""
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
    """A word of the binary part, perhaps a count, is made huge."""
    at = rng.choice([8, 12, 80, 4 * rng.randrange(max(1, len(data) // 4))])
    value = rng.choice([10**9, 2**31 - 1, 2**31, 2**32 - 1, 0, 1])
    return data[:at] + struct.pack("<I", value) + data[at + 4 :]


def _unreal(data: bytes, rng: random.Random) -> bytes:
    """A word is made a float that is NaN, infinite or huge."""
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
    """Lines are shuffled, left out or doubled."""
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
    """A value of a document is replaced by an odd value or by another value of the document, or is left
    out."""
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


RENDER = ["--size", "16x12"]


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
    options = [] if kind == "scene" else RENDER
    return Case(f"{kind}: {', '.join(names)}", ["render", main, *options], {**files, damaged: data})


def _damaged_document(rng: random.Random) -> Case:
    """A glTF document with odd values."""
    if rng.random() < 0.5:
        document, buffer = document_of(None)
        files = {"a.glb": glb(_mutated_document(document, rng), buffer)}
    else:
        document, buffer = document_of("a.bin")
        files = {"a.gltf": json.dumps(_mutated_document(document, rng)).encode(), "a.bin": buffer}
    return Case("glTF document", ["render", next(iter(files)), *RENDER], files)


def _outside(rng: random.Random) -> Case:
    """A reference leaves the folder. The file that it names outside is good."""
    name = rng.choice(
        split(
            "../secret.bin|sub/../../secret.bin|%2e%2e/secret.bin|..%2Fsecret.bin|link.bin|sub/link/secret.bin|"
            "file:../secret.bin|http://localhost:1/secret.bin|//localhost/secret.bin|C:\\secret.bin|/dev/zero|"
            "/proc/self/mem"
        )
    )
    files = {"../secret.bin": document_of(None)[1], "../secret.mtl": LIBRARY, "sub": None}
    files["sub/link"] = "../.."
    main = rng.choice(["a.obj", "a.gltf", "a.toml"])
    if main == "a.obj":
        name = name.replace(".bin", ".mtl").replace("%2e", ".").replace("%2F", "/")
        files |= {"a.obj": obj().replace(b"a.mtl", name.encode()), "link.mtl": "../secret.mtl"}
    else:
        files |= {**gltf(name), "link.bin": "../secret.bin"}
        files |= {"a.toml": SCENE.replace(b"a.stl", b"a.gltf")}
    # A material file outside is reported, and not read.
    return Case(f"outside: {name}", ["render", main, *RENDER], files, must_fail=main != "a.obj")


def _inside_but_odd(rng: random.Random) -> Case:
    """References stay inside, and name things that cannot be read as a file."""
    files = gltf(rng.choice(["folder", "pipe", "loop", "missing.bin", "", ".", "a.gltf", "\0", "x" * 300]))
    files |= {"folder": None, "pipe": os.mkfifo, "loop": "loop"}
    return Case("odd reference", ["render", "a.gltf", *RENDER], files, must_fail=True)


def _nodes(rng: random.Random) -> Case:
    """Nodes form a circle or a long row, or double at every step."""
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
        # There are two nodes a level, and each is the parent of both nodes below.
        nodes = [{"children": [k + 2 - k % 2, k + 3 - k % 2]} for k in range(60)] + [{"mesh": 0}] * 2
    document["nodes"] = nodes
    if kind == "many roots":
        document["scenes"] = [{"nodes": list(range(len(nodes)))}]
    must_fail = kind not in ("many roots", "long")
    files = {"a.glb": glb(document, buffer)}
    return Case(f"nodes: {kind} {row}", ["render", "a.glb", *RENDER], files, must_fail)


def _huge_header(rng: random.Random) -> Case:
    """A header promises a thousand million of something."""
    count = rng.choice([10**9, 2**31 - 1, 2**31, 2**32 - 1, 10**12, 10**18, 2**63, 10**30])
    good, kind = good_files(), rng.choice(["ply", "ascii ply", "stl", "count", "length", "glb", "no view"])
    if kind in ("ply", "ascii ply"):
        old, new = rng.choice([(b"vertex 6", b"vertex %d" % count), (b"face 8", b"face %d" % count)])
        files = {"a.ply": good[kind]["a.ply"].replace(old, new)}
    elif kind == "stl":
        files = {"a.stl": bytes(80) + struct.pack("<I", count % 2**32 or 10**9) + bytes(rng.choice([0, 50]))}
    else:
        document, buffer = document_of(None)
        part = rng.choice(document["accessors"][:3])
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
    # A view that is longer than the buffer may be cut to the buffer, and still hold the accessor's data.
    must_fail = kind != "length"
    return Case(f"header: {kind} {count}", ["render", next(iter(files)), *RENDER], files, must_fail)


def _long_text(rng: random.Random) -> Case:
    """A little data is read over and over, or nested."""
    kind = rng.choice(["spaces", "corners", "tabs", "nested", "materials", "dots", "continued", "digits"])
    text = obj()
    texts = {
        "spaces": text + b" " * 200_000 + b"\n",
        "corners": text + b"f" + b" 1" * 100_000 + b"\n",
        "tabs": text.replace(b" ", b"\t" * 3000),
        "dots": text + b"." * 300_000,
        "continued": text + b"\\\n" * 100_000,
        "digits": text + b"v " + b"9" * 200_000 + b" 0 0\n",
    }
    if kind in texts:
        files = {"a.obj": texts[kind], "a.mtl": LIBRARY}
    elif kind == "nested":
        files = {"a.gltf": b'{"a":' + rng.choice([b"[" * 100_000, b'{"a":' * 100_000])}
    else:
        lines = b"".join(b"usemtl m%d\nf 1 2 3\n" % k for k in range(5000))
        library = b"".join(b"newmtl m%d\nNs %d\n" % (k, k) for k in range(5000))
        files = {"a.obj": text + lines, "a.mtl": library}
    return Case(f"long: {kind}", ["render", next(iter(files)), *RENDER], files)


def _odd_name(rng: random.Random) -> Case:
    """A good file has an odd name."""
    stems = split(
        "зображення|🫖|a\u202eb|a\u0301|\udcff|-o|%41|{x}|$HOME|.|'|\"|\\|*|a;b|\x1b[31m|\x7f|CON|~"
    )
    stem = rng.choice([*stems, "", " ", "a b", "a\nb", "a\tb", "\u2028", "a" * 250])
    kind = rng.choice(["obj", "stl", "ply", "glb", "scene"])
    files = good_files()[kind]
    suffix = Path(next(iter(files))).suffix
    name = f"{stem}{suffix}"
    files = {name: next(iter(files.values())), "a.stl": good_files()["stl"]["a.stl"]}
    return Case(f"name: {name!r}", ["render", *RENDER, "--", name], files)


def _no_file(rng: random.Random) -> Case:
    """The path is not a file."""
    name = "a" + rng.choice([".obj", ".stl", ".ply", ".glb", ".gltf", ".toml"])
    content = rng.choice([None, os.mkfifo, name, "missing", "/dev/zero", "/dev/null", "/proc/self/mem", b""])
    shown = "folder" if content is None else getattr(content, "__name__", content)
    return Case(f"no file: {shown}", ["render", name, *RENDER], {name: content}, must_fail=True)


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
    """The malformed file of number ``index``."""
    rng = random.Random(f"{seed} {index}")
    return rng.choices(list(_KINDS), list(_KINDS.values()))[0](rng)
