"""Scenes with a default for every option."""

import math
import os
import warnings
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Triple
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.scene import Scene
from blysk.sim.api.options import COEFFICIENTS, SCENE, SceneOptions, Source
from blysk.sim.api.settings import Settings, read_settings
from blysk.sim.api.signature import with_options
from blysk.sim.frames.animation import equal_distance, turned, turntable
from blysk.sim.meshes.loaded_mesh import LoadedMesh, merged
from blysk.sim.meshes.materials import FileMaterial, surfaces
from blysk.sim.meshes.mesh import given_mesh, load_mesh

__all__ = ["load", "scene", "scenes_of", "warn_of_ignored", "without_albedo"]

# Options that replace the camera of a file.
_CAMERA = ("projection", "view", "position", "target", "up", "field_of_view")


@with_options(SCENE)
def scene(source: Source = "teapot", **options: Unpack[SceneOptions]) -> Scene:
    """A scene with the defaults of the command line.

    The mesh, the camera and the lights are scaled by the same power of two, so that no product of coordinates
    overflows. This changes no bit of the picture. Colours are ``"#rrggbb"`` in sRGB, or one number or three
    of linear light. Each option also takes the text of the command line: ``size="640x480"``.

    Parameters
    ----------
    source : str or path or Mesh or trimesh.Trimesh or trimesh.Scene or arrays
        ``"teapot"``, a mesh file (see `load_mesh`), a scene file (``.toml``), a mesh (also of trimesh), or
        arrays ``(vertices, faces)`` or ``(vertices, faces, normals)`` (see `given_mesh`).
    size : two ints
        Width and height in pixels, 1 to 4095; by default 640 and 480.
    background, ambient_light, back_faces
        See `Scene`; by default ``"#1a1c20"``, 1 and ``"flip"``.
    triangles : int
        Approximate number of triangles of the teapot; by default 10,000.
    crease : float
        In a mesh without normals, an edge is sharp if the normals of its faces differ by more than this
        angle. In degrees; by default 40.
    materials : {"file", "one"}
        Use the mesh file's materials and colours, or one material for all faces; by default ``"file"``.
    projection : {"perspective", "orthographic"}
        Projection of the camera; by default perspective.
    view : three floats or str
        Direction from the mesh to the viewer, or ``"front"``, ``"back"``, ``"left"``, ``"right"``, ``"top"``,
        ``"bottom"``. The camera shows the whole mesh. The default is (0.4, 0.5, 1) along right, up and front.
        Front is (0, 0, 1), or (0, -1, 0) if ``up`` is z. Right is the cross product of up and front. If no
        option of the camera is given, the camera of a glTF file is used.
    position, target : three floats
        Position of the camera, and the point in the middle of its picture. ``position`` replaces ``view``.
        The default of ``target`` is the middle of the mesh. Both are in the mesh's units.
    up : three floats or {"x", "y", "z"}
        Direction that points up in the picture, by default y for all formats. STL files often need z.
    field_of_view : float
        See `Camera`; by default 30.
    viewer : {"distant", "near"}
        See `Scene`; by default ``"distant"``. ``"near"`` needs the method ``chord-local``.
    lights : Light or dict or numbers or str, or a sequence of these
        At most 16; by default the lights of a glTF file, else one light from (-0.5, 0.8, 0.7). A dict has
        fields of `Light`. Numbers are a direction, or direction and colour. Lights with a position need the
        method ``chord-local``. They may fade by distance or be spots. Lights of colour 0 are off, and left
        out.
    point_lights, spot_lights
        More lights in the same forms. Their numbers are as for ``--point-light`` and ``--spot-light``.
    ambient, diffuse, specular, exponent, roughness, fresnel
        See `Material`; by default the values of the mesh file's materials, else copper and exponent 50. An
        exponent that is given here also replaces the roughness of a file.

    Raises
    ------
    InputError
        If the mesh cannot be read, or a value is out of range.

    Warns
    -----
    RuntimeWarning
        If the mesh file has contents that belong to the picture but are not drawn; see `LoadedMesh`.
    """
    settings = read_settings(source, options, SCENE)
    with settings.located():
        loaded = load(settings)
        warn_of_ignored(loaded)
        return scenes_of(loaded, settings)[0]


def warn_of_ignored(loaded: LoadedMesh) -> None:
    """Warn of contents of a mesh that are not drawn. The warning names the line of the caller's caller."""
    if loaded.ignored:
        text = f"{loaded.name} is drawn without: {'; '.join(loaded.ignored)}"
        warnings.warn(text, RuntimeWarning, stacklevel=3)


def load(
    settings: Settings,
    *,
    lights: int = MAX_LIGHTS,
    local: bool = True,
    albedo: bool = True,
    cutoffs: bool = True,
) -> LoadedMesh:
    """The mesh of a scene, with its materials.

    The settings take the lights of the mesh file, unless an option names lights. If a light has a position,
    the default method is ``chord-local``. The result has the camera of the file, unless an option sets the
    camera.

    Parameters
    ----------
    settings : Settings
        All options of `scene`.
    lights : int
        Largest number of lights that a file may have.
    local : bool
        Whether lights of a file may have positions.
    albedo : bool
        Whether there may be vertex colours, textures and cutoffs of alpha. If not, the mesh lacks them, and
        ``ignored`` names them.
    cutoffs : bool
        The same for cutoffs of alpha alone.

    Raises
    ------
    InputError
        As `load_mesh`. If a scene file names the mesh, the error names this file and its key.
    """
    source = settings.source
    if isinstance(source, Scene):
        return LoadedMesh(source.mesh, "scene", 0, 0)
    if isinstance(source, Mesh):
        loaded = LoadedMesh(source, "mesh", 0, 0, materials=(FileMaterial(colored=len(source.colors) > 0),))
        return _without(loaded, not albedo, not (albedo and cutoffs))
    if not isinstance(source, str | os.PathLike):
        return given_mesh(source, settings["crease"])
    with settings.mesh_located():
        loaded = load_mesh(
            os.fspath(source),
            triangles=settings["triangles"],
            crease_angle=settings["crease"],
            materials=settings["materials"] == "file",
            lights=0 if "lights" in settings.given else lights,
            local=local,
            camera=settings.given.isdisjoint(_CAMERA),
        )
    if loaded.lights:
        settings.use_lights(loaded.lights)
    if loaded.camera is not None and not _sees(loaded.camera, loaded.mesh, settings["size"]):
        reason = "a camera that does not see the mesh"
        loaded = replace(loaded, camera=None, ignored=(*loaded.ignored, reason))
    return _without(loaded, not albedo, not (albedo and cutoffs))


def _sees(camera: Camera, mesh: Mesh, size: tuple[int, int]) -> bool:
    """Whether the picture may show a triangle.

    No triangle is shown if all its corners are beyond the same border, or all are nearer than the near plane.
    """
    width, height = size
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, weight, depth = np.moveaxis(camera.homogeneous(mesh.vertices, width, height), -1, 0)
        beyond = np.stack((x < 0, x > width * weight, y < 0, y > height * weight, depth < camera.near))
    return not bool(beyond[:, mesh.faces].all(axis=2).any(axis=0).all())


def without_albedo(loaded: LoadedMesh, reason: str) -> LoadedMesh:
    """The mesh without vertex colours and textures; ``ignored`` names them with a reason."""
    return _without(loaded, True, False, reason)


def _without(loaded: LoadedMesh, albedo: bool, cutoffs: bool, reason: str = "") -> LoadedMesh:
    """The mesh without vertex colours and textures, and without cutoffs of alpha; ``ignored`` names them.

    If ``albedo``, the mesh loses vertex colours and textures, for a reason. If ``cutoffs``, it loses cutoffs
    of alpha.
    """
    materials, left_out = loaded.materials, []
    mesh: dict[str, Any] = {}
    plain: dict[str, Any] = {}
    if albedo and any(material.has_albedo for material in materials):
        left_out += ["vertex colours"] if len(loaded.mesh.colors) else []
        textures = len({id(material.texture) for material in materials if material.texture is not None})
        left_out += [f"{textures} texture{'s' * (textures > 1)}"] if textures else []
        left_out = [f"{' and '.join(left_out)} ({reason})"] if reason else left_out
        mesh |= {"colors": np.zeros((0, 3)), "coordinates": np.zeros((0, 2))}
        plain |= {"texture": None, "colored": False}
    if cutoffs and (cut := sum(material.cutoff is not None for material in materials)):
        left_out.append(f"{cut} cutoff{'s' * (cut > 1)} of alpha")
        mesh["alpha"] = np.zeros(0)
        plain |= {"alpha": 1.0, "cutoff": None}
    if not plain:
        return loaded
    loaded = replace(loaded, mesh=replace(loaded.mesh, **mesh), ignored=(*loaded.ignored, *left_out))
    return merged(loaded, dict(enumerate(replace(material, **plain) for material in materials)))


def scenes_of(loaded: LoadedMesh, settings: Settings, count: int = 1) -> list[Scene]:
    """Scenes of a mesh: a single scene, or the scenes of a turntable. They differ only in the camera.

    Parameters
    ----------
    loaded : LoadedMesh
        The mesh.
    settings : Settings
        All options of `scene`. If the source is a scene, this scene is the first.
    count : int
        Number of frames of a turntable.

    Raises
    ------
    OptionError
        If a value is out of range, or a term is too bright for the pipeline.
    """
    if isinstance(settings.source, Scene):
        made = settings.source
        cameras = turntable(made.camera, count)
    else:
        made, cameras = _made(loaded, settings, count)
    try:
        for index in range(len(made.materials)):
            FrameConstants.of(made, index=index)
    except ValueError as error:
        raise settings.refuse("lights", str(error), "make the light darker", "") from None
    return [replace(made, camera=camera) for camera in cameras]


def _made(loaded: LoadedMesh, settings: Settings, count: int) -> tuple[Scene, list[Camera]]:
    """The first scene, and the cameras of all scenes."""
    mesh = loaded.mesh
    # Products of huge or tiny coordinates would overflow. The camera frames the mesh in any unit.
    shift = -int(np.frexp(np.abs(mesh.vertices).max())[1])
    mesh = replace(mesh, vertices=np.ldexp(mesh.vertices, shift))
    width, height = settings["size"]
    cameras = _cameras(mesh.vertices, shift, settings, count, loaded.camera)
    made = Scene(
        mesh=mesh,
        camera=cameras[0],
        width=width,
        height=height,
        material=_materials(loaded, settings),
        lights=tuple(light.scaled(shift) for light in settings.lights),
        **{name: settings[name] for name in ("viewer", "back_faces", "ambient_light", "background")},
    )
    return made, cameras


def _materials(loaded: LoadedMesh, settings: Settings) -> tuple[Material, ...]:
    """The file's materials. Coefficients from options replace coefficients of the file."""
    default = Material(*(settings[name] for name in COEFFICIENTS))
    return surfaces(loaded.materials, default, settings.given.intersection(COEFFICIENTS))


def _cameras(
    vertices: np.ndarray, shift: int, settings: Settings, count: int, of_file: Camera | None
) -> list[Camera]:
    """Cameras of a mesh whose vertices have been multiplied by ``2**shift``."""
    by_position = settings["position"] is not None
    if of_file is not None and settings["viewer"] == "near" and of_file.projection != "perspective":
        remedy = "give a view, or a distant viewer"
        raise settings.refuse("viewer", "the orthographic camera of the file is distant", remedy)
    try:
        if of_file is not None:
            return turntable(of_file.scaled(shift), count)
        if by_position:
            return turntable(_placed(vertices, shift, settings), count)
        return _framing(vertices, settings, count)
    except OverflowError:
        reason, remedy = "the camera is too far away for the mesh", "move it nearer"
    except ValueError as error:
        reason, remedy = str(error), "choose another direction or position for the camera"
    raise settings.refuse("position" if by_position else "view", reason, remedy)


def _framing(vertices: np.ndarray, settings: Settings, count: int) -> list[Camera]:
    """Cameras that show the whole mesh."""
    width, height = settings["size"]
    view, up = settings["view"], settings["up"]
    # The first direction is the same to the bit for any number of directions.
    views = [view, *turned(normalise(view), up, count)[1:].tolist()]
    kind = settings["projection"], width / height, settings["field_of_view"]
    return equal_distance([Camera.framing(vertices, view, *kind, up=up) for view in views])


def _shifted(point: ArrayLike, shift: int = 0) -> Triple:
    """A point multiplied by ``2**shift``, like the vertices of the mesh."""
    x, y, z = np.asarray(point, dtype=np.float64).tolist()
    return math.ldexp(x, shift), math.ldexp(y, shift), math.ldexp(z, shift)


def _placed(vertices: np.ndarray, shift: int, settings: Settings) -> Camera:
    """The camera at the position that the settings give."""
    position = _shifted(settings["position"], shift)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    target = _shifted(low + (high - low) / 2)
    if settings["target"] is not None:
        target = _shifted(settings["target"], shift)
    distance = math.dist(position, target)
    if not 1e-12 < distance < 1e12:
        raise ValueError(
            "the camera is at its target" if distance < 1 else "the camera is too far away for the mesh"
        )
    field_of_view = settings["field_of_view"]
    return Camera(
        position,
        target,
        settings["up"],
        settings["projection"],
        height=2 * distance * math.tan(math.radians(field_of_view) / 2),
        field_of_view=field_of_view,
        near=distance / 1000,
    )
