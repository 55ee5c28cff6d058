"""Values of options. Values of the caller override a scene file, which overrides the defaults."""

import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.presets import default_method
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Light, Triple
from blysk.golden.reference.scene import Scene
from blysk.sim.api.options import DESIGN, LIGHTS, RENDERING, SCENE, SLOW_SIZE, Engine, Option, Source
from blysk.sim.api.scene_file import read_scene_file
from blysk.sim.errors import InputError, OptionError
from blysk.sim.meshes.mesh_path import check_mesh_file
from blysk.sim.run_files import OutputIsInput
from blysk.sim.value_types import Choice, PartError, plain, shown

__all__ = ["Settings", "check_engine", "check_mesh", "checked", "read_settings", "rendering_settings"]


@dataclass(frozen=True)
class Settings:
    """Values of options, and the origin of each value.

    Parameters
    ----------
    source : str or path or Mesh or Scene
        The mesh, or a whole scene.
    values : dict
        Value of every option.
    given : frozenset of str
        Names of the options with a value from the caller or a scene file.
    origins : dict
        File and key of each value from a scene file, also of ``mesh``.
    """

    source: Source | Scene
    values: dict[str, Any]
    given: frozenset[str]
    origins: dict[str, str]

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def refuse(self, name: str, reason: str, remedy: str, value: object = None) -> OptionError:
        """The error of a value. Without ``value`` the message shows the value of these settings."""
        return OptionError(name, self.values[name] if value is None else value, reason, remedy)

    @property
    def lights(self) -> tuple[Light, ...]:
        """Lights of the scene or of the options. Lights that are off are left out, and need no hardware."""
        if isinstance(self.source, Scene):
            return self.source.lights
        return tuple(light for light in self["lights"] if light.is_on)

    def use_lights(self, lights: tuple[Light, ...]) -> None:
        """Use these lights in place of the default light, and choose a default method that serves them."""
        self.values["lights"] = lights
        if "method" in self.values and "method" not in self.given:
            self.values["method"] = _method(self.source, self.values)

    @contextmanager
    def located(self) -> Iterator[None]:
        """Within the block, the error of a value from a scene file names file and key."""
        try:
            yield
        except OptionError as error:
            if error.option in self.origins:
                raise error.at(self.origins[error.option]) from None
            raise

    @contextmanager
    def mesh_located(self) -> Iterator[None]:
        """Within the block, the error of a mesh from a scene file also names file and key."""
        try:
            yield
        except InputError as error:
            if "mesh" not in self.origins or isinstance(error, OutputIsInput):
                raise
            raise InputError(self.origins["mesh"], f"{error.thing}, {error.reason}", error.remedy) from error


def checked(options: Mapping[str, Any], table: Mapping[str, Option]) -> dict[str, Any]:
    """Values of options, checked and converted by their types. Options that are ``None`` are left out.

    Raises
    ------
    OptionError
        If a value is not accepted.
    TypeError
        If there is no option of a name.
    """
    result = {}
    for name, value in options.items():
        if name not in table:
            raise TypeError(f"there is no option {name!r}; use one of {', '.join(table)}")
        if value is None:
            continue
        kind = table[name].kind
        try:
            result[name] = kind.read(plain(value))
        except PartError as error:
            reason = f"{error.key}, {error}" if error.key else str(error)
            raise OptionError(name, "", reason, error.remedy) from None
        except ValueError as error:
            raise OptionError(name, shown(value), str(error), kind.in_python) from None
    return result


def read_settings(
    source: Source | Scene, options: Mapping[str, Any], table: Mapping[str, Option], **defaults: Any
) -> Settings:
    """Settings from a caller's options. Missing values come from the scene file or the defaults.

    Parameters
    ----------
    source : str or path or Mesh or Scene
        The mesh, scene file or scene to draw.
    options : dict
        Options of the table; ``None`` counts as not given.
    table : dict
        All options.
    **defaults
        Defaults that replace defaults of the table.

    Raises
    ------
    InputError
        If a value or the scene file is not accepted, or two values exclude each other.
    TypeError
        If there is no option of a name.
    """
    given = _one_list_of_lights(checked(options, table))
    values: dict[str, Any] = {}
    origins: dict[str, str] = {}
    if isinstance(source, str | os.PathLike) and Path(source).suffix.lower() == ".toml":
        file = read_scene_file(source)
        dropped = set(given).union(*(_INSTEAD.get(name, ()) for name in given))
        names = ({"mesh"} | table.keys()) - dropped
        values = {name: value for name, value in file.values.items() if name in names}
        origins = {name: f"{file.path}, {file.keys[name]}" for name in values}
        source = values.pop("mesh")
    every = checked({**{name: option.default for name, option in table.items()}, **defaults}, table)
    merged = dict.fromkeys(table) | every | values | given
    if "view" in merged:
        _turn_view(merged, {*given, *values})
    if "method" in merged and merged["method"] is None:
        merged["method"] = _method(source, merged)
    settings = Settings(source, merged, frozenset(given) | frozenset(values), origins)
    with settings.located():
        _check_pairs(settings)
    return settings


def _method(source: Source | Scene, values: Mapping[str, Any]) -> str:
    """The method of settings that name no method."""
    if isinstance(source, Scene):
        local = source.lit.local
    else:
        lights = values.get("lights")
        near = values.get("viewer") == "near"
        local = near or (
            isinstance(lights, tuple) and any(light.is_on and light.is_local for light in lights)
        )
    model, gate = values["model"], bool(values["gate"])
    return default_method(model, gate, values["operand"], values["setup_interval"], local)


def rendering_settings(
    source: Source | Scene, options: dict[str, Any], vcd: str | os.PathLike[str] | None = None
) -> Settings:
    """All options of a rendering; see `read_settings`."""
    slow = {"size": SLOW_SIZE} if vcd else {}
    settings = read_settings(source, options, {**SCENE, **DESIGN, **RENDERING}, **slow)
    with settings.located():
        if settings["short_words"] and not settings["specialise"]:
            raise settings.refuse(
                "short_words", "nothing is specialised", "leave it out, or also give specialise", ""
            )
    return settings


def check_engine(engine: str) -> None:
    """Refuse an unknown engine.

    Raises
    ------
    OptionError
        If there is no engine of that name.
    """
    checked({"engine": engine}, {"engine": Option(Choice("engine", get_args(Engine)), "auto", "")})


def check_mesh(settings: Settings) -> None:
    """Refuse a mesh file that does not exist or has an unknown type, without opening it.

    Raises
    ------
    InputError
        As `load_mesh`.
    """
    if isinstance(settings.source, str | os.PathLike):
        with settings.mesh_located():
            check_mesh_file(settings.source)


def _one_list_of_lights(given: dict[str, Any]) -> dict[str, Any]:
    """The options, with lights of all kinds in ``lights``."""
    kinds = [name for name in LIGHTS if isinstance(given.get(name), tuple)]
    lights = tuple(light for name in kinds for light in given[name])
    if len(lights) > MAX_LIGHTS:
        raise OptionError("lights", "", f"{len(lights)} lights", f"give at most {MAX_LIGHTS}")
    rest = {name: value for name, value in given.items() if name not in kinds}
    return rest | {"lights": lights} if kinds else rest


def _turn_view(values: dict[str, Any], given: Collection[str]) -> None:
    """Replace a word for the view by vectors, and turn the default view with another ``up``.

    The front of a mesh is along z, or along -y if ``up`` is z. Right is the cross product of up and front.
    Seen from the top, the front is at the bottom of the picture. Seen from the bottom, the front is at the
    top of the picture.
    """
    view, up = values["view"], np.array(values["up"], dtype=np.float64)
    if not isinstance(view, str) and ("view" in given or "up" not in given):
        return
    up = normalise(up)
    front = np.array([0.0, -1.0, 0.0] if np.abs(up).argmax() == 2 else [0.0, 0.0, 1.0])
    front = normalise(front - (front @ up) * up)
    right = np.cross(up, front)
    if not isinstance(view, str):
        values["view"] = _triple(view[0] * right + view[1] * up + view[2] * front)
        return
    sides = {"front": front, "right": right, "top": up}
    opposites = {"back": front, "left": right, "bottom": up}
    values["view"] = _triple(sides[view] if view in sides else -opposites[view])
    if view in ("top", "bottom"):
        values["up"] = _triple(-front if view == "top" else front)


def _triple(vector: np.ndarray) -> Triple:
    x, y, z = (vector + 0.0).tolist()
    return x, y, z


_INSTEAD = {"view": ("position", "target"), "position": ("view", "target")}
"""Options of a scene file that an option of the caller replaces, besides the option of its own name."""


def _check_pairs(settings: Settings) -> None:
    """Refuse values that exclude each other."""
    given = settings.given
    if isinstance(settings.source, Scene):
        for name in SCENE:
            if name in given:
                raise settings.refuse(name, "the scene has its own", "leave it out, or change the scene")
        return
    if "position" in given and "view" in given:
        raise settings.refuse("view", "the camera also has a position", "leave one of them out")
    if "target" in given and "position" not in given:
        raise settings.refuse("target", "the camera has no position", "also give a position")
    if "triangles" in given and not (isinstance(settings.source, str) and settings.source == "teapot"):
        raise settings.refuse("triangles", "only the teapot is tessellated", "leave it out for a file")
    if settings.values.get("viewer") == "near" and settings["projection"] != "perspective":
        raise settings.refuse("viewer", "an orthographic camera is distant", "use a perspective camera")
