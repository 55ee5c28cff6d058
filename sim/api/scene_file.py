"""Scene files: all options of a picture in TOML."""

import json
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any, TypeVar

from blysk.golden.text import plain_text
from blysk.sim.api.lights import Lights
from blysk.sim.api.options import DESIGN, RENDERING, SCENE
from blysk.sim.api.signature import in_python
from blysk.sim.errors import InputError
from blysk.sim.run_files import reads
from blysk.sim.value_types import PartError, Value, shown, shown_key

__all__ = ["MAX_BYTES", "SceneFile", "key_lines", "read_scene_file"]

MAX_BYTES = 100_000
"""Largest scene file, in bytes. A scene file holds no mesh."""

_MAX_DOTS = 256
"""Largest number of dots in a line.

`tomllib` takes memory that grows with the square of the number of dots in a key.
"""


@dataclass(frozen=True)
class SceneFile:
    """Values of a scene file.

    Parameters
    ----------
    path : str
        The file.
    values : dict
        Values that the file sets, by the names of the options and in their types. ``mesh`` is ``teapot`` or a
        path. A relative path is joined to the folder of the scene file.
    keys : dict
        The key of each value, for messages: ``material.exponent``.
    """

    path: str
    values: dict[str, Any]
    keys: dict[str, str]


Reader = TypeVar("Reader", bound=Callable[..., SceneFile])


def _with_rendering(function: Reader) -> Reader:
    """Put the keys of `RENDERING` into a docstring as comments, with their defaults and helps."""
    if function.__doc__:
        before, _, after = function.__doc__.partition("{rendering}")
        indent, column, lines = before.rpartition("\n")[2], 36, []
        for name, option in RENDERING.items():
            text = wrap(in_python(option.help), 100 - column)
            lines.append(f"{f'# {name} = {json.dumps(option.default)}':<{column}}# {text[0]}")
            lines += [f"{'':<{column}}# {more}" for more in text[1:]]
        function.__doc__ = before + f"\n{indent}".join(lines) + after
    return function


@_with_rendering
def read_scene_file(path: str | os.PathLike[str]) -> SceneFile:
    """Read a scene file.

    These are the keys. Only ``mesh.file`` is required::

        size = [640, 480]
        background = "#1a1c20"              # sRGB; or [r, g, b] or one number, linear light, each 0 to 1
        ambient_light = [1, 1, 1]           # up to 8
        back_faces = "flip"                 # "show", "cull"

        [mesh]
        file = "teapot"                     # or a mesh file, from this file's folder
        triangles = 10000                   # of the teapot
        crease = 40                         # degrees; for a mesh without normals
        materials = "file"                  # the materials of the mesh file, or "one"

        [camera]
        projection = "perspective"          # "orthographic"
        view = [0.4, 0.5, 1]                # from the mesh to the viewer; the camera shows the whole mesh
        # or "front", "back", "left", "right", "top", "bottom"
        up = [0, 1, 0]                      # or "x", "y", "z"
        field_of_view = 30                  # degrees, vertical, 1 to 179
        # position, target                  # replace view; in the mesh's own units
        viewer = "distant"                  # "near": highlights seen from a perspective camera

        [[lights]]                          # a table for each light; without lights: lights = []
        direction = [-0.5, 0.8, 0.7]        # to the light
        # position                          # of a point light, replaces direction; in the mesh's own units
        color = [1, 1, 1]                   # or "#rrggbb"; may exceed 1
        # attenuation = [1, 0, 0]           # of a point light: 1/(k0 + k1 d + k2 d^2), at most 1; d: distance
        # spot = [0, -1, 0]                 # a point light that shines along this
        # cone = [20, 30]                   # degrees: full light up to the first, none from the second on

        [material]
        ambient = [0.08, 0.05, 0.03]        # colours, as background
        diffuse = [0.75, 0.42, 0.2]
        specular = 0.6
        exponent = 50
        # roughness = 0.2                   # of ggx and beckmann, over 0, up to 1; default: from the exponent
        # fresnel                           # F_0 of Schlick's reflection, a colour; by default none

        [pipeline]
        method = "quotient"
        model = "blinn"
        style = "throughput"                # "compact"
        transfer = "srgb"                   # codes of the picture; "linear": linear light
        gate = false                        # the highlight gate, of other methods
        # operand = "cosine"                # "one_minus_cosine"; for methods that compute unit normals
        # setup_interval = 4                # for methods with this choice
        {rendering}

    The values have the ranges of the command line. They may also be texts of the command line: ``size =
    "640x480"``. This function checks neither the mesh file nor conflicts between values.

    Parameters
    ----------
    path : path
        The file, in UTF-8, with at most 100,000 bytes, and at most 256 dots in a line.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or names no mesh. If a key is unknown, or a value has another
        type or is out of range. The message names the file and the key.
    """
    values: dict[str, Any] = {}
    keys: dict[str, str] = {}
    try:
        _read_table(_parse(Path(path)), _SCHEMA, "", values, keys)
        if "mesh" not in values:
            raise PartError("mesh.file", "is missing", "name a mesh file, or teapot")
    except PartError as error:
        thing = f"{os.fspath(path)}, {error.key}" if error.key else os.fspath(path)
        raise InputError(thing, str(error), error.remedy) from error.__cause__
    if values["mesh"] != "teapot":
        values["mesh"] = os.path.join(os.path.dirname(os.fspath(path)), values["mesh"])
    return SceneFile(os.fspath(path), values, keys)


def _parse(path: Path) -> dict[str, Any]:
    try:
        if not path.exists():
            raise PartError("", "there is no such file", "check the path")
        if path.is_dir():
            raise PartError("", "is a folder", "name a scene file in it")
        if not path.is_file():
            raise PartError("", "is not a regular file", "name a scene file")
        reads(path)
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except PartError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise PartError("", f"cannot be opened ({reason})", "check the path and its permissions") from error
    if len(data) > MAX_BYTES:
        raise PartError(
            "", f"is over {MAX_BYTES:,} bytes", "keep the mesh in a file of its own, and name it by mesh.file"
        )
    try:
        whole = plain_text(data)
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise PartError("", f"is not UTF-8 (line {line})", "save it as UTF-8 text") from error
    for line, text in enumerate(whole.split("\n"), 1):
        if text.count(".") > _MAX_DOTS:
            raise PartError("", f"has over {_MAX_DOTS} dots in line {line}", "break the line")
    try:
        return tomllib.loads(whole)
    except RecursionError as error:
        raise PartError("", "is nested too deeply", "see blysk render --help for the keys") from error
    # A syntax error, or a whole number of more than 4300 digits.
    except ValueError as error:
        text = str(error).split("\n")[0]
        raise PartError("", f"is not TOML ({text})", "correct it there; put text in quotes") from error


def _read_table(
    table: Mapping[str, Any],
    schema: Mapping[str, Any],
    prefix: str,
    values: dict[str, Any],
    keys: dict[str, str],
) -> None:
    for name, value in table.items():
        key = prefix + shown_key(name)
        if name not in schema:
            if not prefix and name == "materials":
                raise PartError(key, "several materials come from the mesh file", "give one [material]")
            raise PartError(key, "unknown key", f"use one of {', '.join(schema)}")
        expected = schema[name]
        if isinstance(expected, dict):
            if not isinstance(value, dict):
                raise PartError(key, f"{shown(value)} is not a table", f"write [{key}], and its keys below")
            _read_table(value, expected, f"{key}.", values, keys)
            continue
        option, kind = expected
        try:
            values[option] = kind.read(value)
        except PartError as error:
            raise PartError(key + error.key, str(error), error.remedy) from None
        except ValueError as error:
            raise PartError(key, f"{shown(value)} is {error}", kind.in_file) from None
        keys[option] = key


class _MeshFile(Value):
    """Name of a mesh file."""

    name = "mesh"
    remedy = "give a mesh file's name, or teapot"

    def check(self, value: Any) -> Any:
        """The name."""
        if not isinstance(value, str):
            raise ValueError("not text")
        if not (value.isprintable() and Path(value).stem):
            raise ValueError("not a file name")
        return value


def _schema() -> dict[str, Any]:
    """Tables of keys, nested as in a file. Each key has the name and the type of its option."""
    schema: dict[str, Any] = {}
    options = {**SCENE, **DESIGN, **RENDERING}
    keys = {"mesh": (_MeshFile(), "mesh.file")} | {
        name: (of.kind, of.key) for name, of in options.items() if of.key
    }
    for name in sorted(keys, key=lambda name: "." in keys[name][1]):
        kind, key = keys[name]
        table, _, last = key.rpartition(".")
        (schema.setdefault(table, {}) if table else schema)[last] = name, kind
    return schema


_SCHEMA = _schema()


def key_lines() -> Iterator[str]:
    """The keys of a scene file, table by table, for the command line's help."""
    yield ", ".join(
        name for name, entry in _SCHEMA.items() if not isinstance(entry, dict) and name != "lights"
    )
    for table, entry in _SCHEMA.items():
        if isinstance(entry, dict):
            yield f"{f'[{table}]':<12}{', '.join(entry)}"
        elif table == "lights":
            yield f"{'[[lights]]':<12}{', '.join(Lights.parts)}"
