"""Scene files: everything that a picture depends on, in TOML."""

import math
import os
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.pipeline import STYLES
from blysk.golden.presets import METHODS, MODELS, PUBLISHED
from blysk.golden.reference.camera import PROJECTIONS
from blysk.golden.reference.scene import BACK_FACES, LARGEST_SIDE, VIEWERS
from blysk.sim.errors import InputError, one_line

__all__ = ["HIGHLIGHTS", "MAX_BYTES", "SceneFile", "read_scene_file"]

MAX_BYTES = 100_000
"""Largest scene file; a mesh is a file of its own."""

HIGHLIGHTS = ("dot", "chord")
"""Forms of the specular argument."""

_WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class SceneFile:
    """What a scene file says.

    Parameters
    ----------
    path : str
        The file.
    values : dict
        What the file sets and nothing else, by the names of the options of ``blysk render``, in the types
        that these have. Beside them ``position``, ``target``, ``up``, ``field_of_view``, ``ambient_light``,
        ``viewer`` and ``point_lights``, which have no option; the latter, positions and colours, stands where
        there are such among the lights, and ``lights`` holds the others. ``mesh`` is ``teapot`` or a path:
        one that is not absolute starts at the scene file's folder.
    keys : dict
        The key of each value, for messages: ``material.exponent``.
    """

    path: str
    values: dict[str, Any]
    keys: dict[str, str]


class _Refused(Exception):
    """A reason and a remedy, before the file's name and the key are put to them."""

    def __init__(self, reason: str, remedy: str):
        super().__init__(reason)
        self.reason = reason
        self.remedy = remedy


def read_scene_file(path: str | os.PathLike) -> SceneFile:
    """Read a scene file.

    The keys, all of them optional but ``mesh.file``::

        size = [640, 480]
        background = "#1a1c20"              # or [r, g, b], or one number, each 0 to 1
        ambient_light = [1, 1, 1]           # up to 8
        back_faces = "flip"                 # "show", "cull"

        [mesh]
        file = "teapot"                     # or a mesh file, from this file's folder
        triangles = 10000                   # of the teapot
        crease = 40                         # degrees, of a mesh without normals
        materials = "file"                  # those of the mesh file, or "one"

        [camera]
        projection = "perspective"          # "orthographic"
        view = [0.4, 0.5, 1]                # from the mesh to the viewer: the camera shows all of the mesh
        up = [0, 1, 0]
        field_of_view = 30                  # degrees, vertical, 1 to 179
        # position, target                  # in place of view, in the mesh's own units
        viewer = "distant"                  # "near": highlights as seen from a perspective camera

        [[lights]]                          # one table a light, none: lights = []
        direction = [-0.5, 0.8, 0.7]        # to the light
        # position                          # of a point light, in place of direction, in the mesh's own units
        color = [1, 1, 1]                   # or "#rrggbb"; may exceed 1

        [material]
        ambient = [0.08, 0.05, 0.03]        # colours, as background
        diffuse = [0.75, 0.42, 0.2]
        specular = 0.6
        exponent = 50

        [pipeline]
        method = "quadratic"
        model = "cosquad"
        highlight = "dot"                   # "chord"
        setup_interval = 4
        style = "throughput"                # "compact"
        gate = false                        # the highlight gate
        fit = false                         # only what the scene needs
        words = false                       # with fit: in words as short as the error bound allows

    The values' ranges are those of the command line. The mesh and what follows from several values at once
    are not looked at.

    Parameters
    ----------
    path : path
        The file, in UTF-8, at most 100,000 bytes.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or holds an unknown key, a value of another type or out of
        range, or no mesh. The message names the file and the key.
    """
    try:
        document = _parse(Path(path))
    except _Refused as refusal:
        raise InputError(os.fspath(path), refusal.reason, refusal.remedy) from None
    values, keys = {}, {}
    try:
        _read_table(document, _TOP, "", values, keys)
        if "mesh" not in values:
            raise _KeyRefused("mesh.file", "is missing", "name a mesh file, or teapot")
        if "view" in values and not {"position", "target"}.isdisjoint(values):
            raise _KeyRefused("camera", "holds both view and position or target", "leave one of them out")
        if "target" in values and "position" not in values:
            raise _KeyRefused("camera.target", "has no position with it", "give camera.position too")
        if "triangles" in values and values["mesh"] != "teapot":
            raise _KeyRefused("mesh.triangles", "only the teapot is tessellated", "leave it out for a file")
    except _KeyRefused as refusal:
        raise InputError(f"{os.fspath(path)}, {refusal.key}", refusal.reason, refusal.remedy) from None
    _part_lights(values, keys)
    if values["mesh"] != "teapot":
        values["mesh"] = os.path.join(os.path.dirname(os.fspath(path)), values["mesh"])
    return SceneFile(os.fspath(path), values, keys)


def _parse(path: Path) -> dict:
    try:
        if not path.exists():
            raise _Refused("there is no such file", "check the path")
        if path.is_dir():
            raise _Refused("is a folder", "name a scene file in it")
        if not path.is_file():
            raise _Refused("is not a regular file", "name a scene file")
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _Refused(f"cannot be opened ({reason})", "check the path and its permissions") from error
    if len(data) > MAX_BYTES:
        raise _Refused(
            f"is over {MAX_BYTES:,} bytes", "keep the mesh in a file of its own, and name it by mesh.file"
        )
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise _Refused(f"is not UTF-8 (line {line})", "save it as UTF-8 text") from error
    except RecursionError as error:
        raise _Refused("is nested too deeply", "see blysk render --help for the keys") from error
    # A syntax error, or a whole number of more than 4300 digits.
    except ValueError as error:
        text = str(error).split("\n")[0]
        raise _Refused(f"is no TOML ({text})", "mend it there; text stands in quotes") from error


class _KeyRefused(_Refused):
    """With the key."""

    def __init__(self, key: str, reason: str, remedy: str):
        super().__init__(reason, remedy)
        self.key = key


def _read_table(table: dict, schema: dict, prefix: str, values: dict, keys: dict) -> None:
    for name, value in table.items():
        key = prefix + (name if re.fullmatch("[A-Za-z0-9_-]{1,40}", name) else _shown(name))
        if name not in schema:
            if not prefix and name == "materials":
                raise _KeyRefused(key, "several materials come from the mesh file", "give one [material]")
            raise _KeyRefused(key, "unknown key", f"use one of {', '.join(schema)}")
        expected = schema[name]
        if isinstance(expected, dict):
            if not isinstance(value, dict):
                raise _KeyRefused(key, f"{_shown(value)} is no table", f"write [{key}], and its keys below")
            _read_table(value, expected, f"{key}.", values, keys)
        else:
            option, read = expected
            try:
                values[option] = read(value)
            except _KeyRefused as refusal:
                raise _KeyRefused(key + refusal.key, refusal.reason, refusal.remedy) from None
            except _Refused as refusal:
                raise _KeyRefused(key, refusal.reason, refusal.remedy) from None
            keys[option] = key


def _shown(value: Any) -> str:
    """A value in a message: in one line, and not too long."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "an array"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) >= 10**18:
        return "a huge number"
    return one_line(repr(value) if isinstance(value, str) else str(value), 40)


# Readers: a value of the file to that of the option, or `_Refused`.

_Reader = Callable[[Any], Any]


def _whole(least: int, most: int) -> _Reader:
    remedy = f"give a whole number from {least} to {most}"

    def read(value):
        if isinstance(value, bool) or not isinstance(value, int):
            raise _Refused(f"{_shown(value)} is not a whole number", remedy)
        if not least <= value <= most:
            raise _Refused(f"{_shown(value)} is out of range", remedy)
        return value

    return read


def _number(least: float, most: float, remedy: str) -> _Reader:
    """A finite number, both ends included."""

    def read(value):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise _Refused(f"{_shown(value)} is not a number", remedy)
        # Comparison comes before the conversion, which a huge whole number would overflow.
        if not (least <= value <= most and -1e300 <= value <= 1e300):
            raise _Refused(f"{_shown(value)} is out of range", remedy)
        return float(value)

    return read


def _vector(remedy: str, zero: bool = False) -> _Reader:
    number = _number(-math.inf, math.inf, remedy)

    def read(value):
        if not isinstance(value, list) or len(value) != 3:
            raise _Refused(f"{_shown(value)} is not three numbers", remedy)
        vector = tuple(number(part) for part in value)
        if not (zero or any(vector)):
            raise _Refused("it has no direction", remedy)
        return vector

    return read


def _color(most: float = 1.0) -> _Reader:
    limits = "of 0 or more" if math.isinf(most) else f"from 0 to {most:g}"
    remedy = f"give '#rrggbb', [red, green, blue] or one number, each {limits}"
    channel = _number(0, most, remedy)

    def read(value):
        if isinstance(value, str) and re.fullmatch("#[0-9a-fA-F]{6}", value):
            return tuple(int(value[k : k + 2], 16) / 255 for k in (1, 3, 5))
        if isinstance(value, str) or (isinstance(value, list) and len(value) != 3):
            raise _Refused(f"{_shown(value)} is not a colour", remedy)
        return tuple(channel(part) for part in value) if isinstance(value, list) else (channel(value),) * 3

    return read


def _choice(names: Sequence[str]) -> _Reader:
    def read(value):
        if value not in tuple(names):
            raise _Refused(f"{_shown(value)} is unknown", f"use one of {', '.join(names)}")
        return value

    return read


def _truth(value):
    if not isinstance(value, bool):
        raise _Refused(f"{_shown(value)} is neither true nor false", "give true or false")
    return value


def _size(value):
    side = _whole(1, LARGEST_SIDE)
    if not isinstance(value, list) or len(value) != 2:
        raise _Refused(f"{_shown(value)} is not a size", "give [width, height], as in [640, 480]")
    return side(value[0]), side(value[1])


def _mesh(value):
    remedy = "give a mesh file's name, or teapot"
    if not isinstance(value, str):
        raise _Refused(f"{_shown(value)} is not text", remedy)
    if not (value.isprintable() and Path(value).stem):
        raise _Refused(f"{_shown(value)} is no file's name", remedy)
    return value


def _lights(value):
    remedy = "write [[lights]] and its direction and color below, for each light"
    if not isinstance(value, list):
        raise _Refused(f"{_shown(value)} is no array of tables", remedy)
    if len(value) > MAX_LIGHTS:
        raise _Refused(f"{len(value)} lights", f"give at most {MAX_LIGHTS}")
    lights = []
    for place, entry in enumerate(value, 1):
        key = f"[{place}]"
        if not isinstance(entry, dict):
            raise _KeyRefused(key, f"{_shown(entry)} is no table", remedy)
        light = {}
        _read_table(entry, _LIGHT, f"{key}.", light, {})
        if "direction" not in light and "position" not in light:
            remedy = "give [x, y, z], from the mesh to the light, or a position"
            raise _KeyRefused(f"{key}.direction", "is missing", remedy)
        if "direction" in light and "position" in light:
            raise _KeyRefused(key, "holds both direction and position", "leave one of them out")
        lights.append(light)
    return tuple(lights)


def _part_lights(values: dict, keys: dict) -> None:
    """Lights with a direction and lights with a position, each as numbers: the vector, then the colour."""
    if "lights" in values:
        lights = values["lights"]
        values["lights"], at = (
            tuple((*light[name], *light.get("color", _WHITE)) for light in lights if name in light)
            for name in ("direction", "position")
        )
        if at:
            values["point_lights"], keys["point_lights"] = at, keys["lights"]


_DIRECTION = "give [x, y, z], a vector other than 0"
_PLACE = "give [x, y, z]"

_LIGHT = {
    "direction": ("direction", _vector(_DIRECTION)),
    "position": ("position", _vector(_PLACE, zero=True)),
    "color": ("color", _color(math.inf)),
}

_TOP = {
    "size": ("size", _size),
    "background": ("background", _color()),
    "ambient_light": ("ambient_light", _color(8)),
    "back_faces": ("back_faces", _choice(BACK_FACES)),
    "mesh": {
        "file": ("mesh", _mesh),
        "triangles": ("triangles", _whole(64, 4_000_000)),
        "crease": ("crease", _number(0, 180, "give 0 to 180 degrees")),
        "materials": ("materials", _choice(("file", "one"))),
    },
    "camera": {
        "projection": ("projection", _choice(PROJECTIONS)),
        "view": ("view", _vector(_DIRECTION)),
        "position": ("position", _vector(_PLACE, zero=True)),
        "target": ("target", _vector(_PLACE, zero=True)),
        "up": ("up", _vector(_DIRECTION)),
        "field_of_view": ("field_of_view", _number(1, 179, "give 1 to 179 degrees")),
        "viewer": ("viewer", _choice(VIEWERS)),
    },
    "lights": ("lights", _lights),
    "material": {
        "ambient": ("ambient", _color()),
        "diffuse": ("diffuse", _color()),
        "specular": ("specular", _color()),
        "exponent": ("exponent", _whole(1, MAX_EXPONENT)),
    },
    "pipeline": {
        "method": ("method", _choice(METHODS | PUBLISHED)),
        "model": ("model", _choice(MODELS)),
        "highlight": ("highlight", _choice(HIGHLIGHTS)),
        "setup_interval": ("setup_interval", _whole(1, 46)),
        "gate": ("gate", _truth),
        "fit": ("fit", _truth),
        "words": ("words", _truth),
        "style": ("style", _choice(STYLES)),
    },
}
