"""A folder for users of the Verilog: a cocotb test bench, and the test vectors of a frame."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np

from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.frames.prepare import prepare
from blysk.golden.pipeline import Pixels, ShadingPipeline, Spans
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit
from blysk.sim.errors import InputError
from blysk.sim.frames.frame import beats_of, sample_material
from blysk.sim.meshes.teapot import teapot
from blysk.sim.output import files_within, write_text

__all__ = ["check_folder", "pixel_beats", "teapot_frame", "vectors", "write_testbench"]

_TEMPLATES = ("run.py", "test_pipeline.py")

_SIZE = 64, 48
_TRIANGLES = 400


def teapot_frame(
    design: ShadingPipeline, size: tuple[int, int] = _SIZE, triangles: int = _TRIANGLES
) -> tuple[Spans, list[FrameConstants], Pixels]:
    """A teapot with as many lights and materials as a pipeline has. No term is too bright for the pipeline.

    Parameters
    ----------
    design : ShadingPipeline
        The pipeline.
    size : two ints
        Width and height of the picture.
    triangles : int
        Approximate number of triangles of the teapot.

    Returns
    -------
    spans : Spans
        The input. The first span has length 0, so it gives no pixel.
    constants : list of FrameConstants
        The constants of each material.
    pixels : Pixels
        The expected output, by the bit-accurate model.
    """
    mesh = teapot(triangles)
    width, height = size
    materials = [
        replace(sample_material(design, 13 + k % 100), diffuse=tuple(np.roll((0.75, 0.42, 0.2), k)))
        for k in range(design.materials)
    ]
    lights = []
    for k in range(design.lights):
        way = np.cos(2 * k + 2), 0.8, np.sin(2 * k + 2)
        light = {"direction": way}
        if k in design.factors:
            light = {"position": np.multiply(8, way), "attenuation": (0.5, 0.1, 0), "spot": np.negative(way)}
        lights.append(Light(color=np.roll((1.0, 0.8, 0.6), k) / design.lights, **light))
    mesh, materials = _colored(mesh, materials, design)
    projection = "orthographic" if design.albedo and not design.albedo.perspective else "perspective"
    scene = Scene(
        mesh=replace(mesh, material=np.arange(len(mesh.faces)) % design.materials),
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, width / height),
        width=width,
        height=height,
        material=materials,
        lights=lights,
    )
    prepared = prepare(scene, design)
    spans = prepared.spans
    spans = spans[np.r_[0, : len(spans)]]
    spans.length[0] = 0
    return spans, prepared.constants, design.compute(spans, prepared.constants)


def _colored(
    mesh: Mesh, materials: Sequence[Material], design: ShadingPipeline
) -> tuple[Mesh, Sequence[Material]]:
    """The mesh with vertex colours, and materials with a texture, if the design shows them."""
    albedo = design.albedo
    if albedo is None:
        return mesh, materials
    if albedo.colors:
        mesh = replace(mesh, colors=mesh.normals / 2 + 0.5)
    if albedo.texture is not None:
        side = min(albedo.texture.memory.fitting(), 8)
        place = np.indices((side, side)).sum(axis=0)[:, :, np.newaxis]
        texture = Texture((place + np.array([0, 2, 4])) % 8 / 7)
        mesh = replace(mesh, coordinates=mesh.vertices[:, :2])
        materials = [replace(of, texture=texture) for of in materials]
    return mesh, materials


def vectors(unit: ShadingPipelineUnit | MergedPipelinesUnit) -> dict[str, dict[str, np.ndarray]]:
    """Inputs and expected outputs of a pipeline for a small frame, by port of its Verilog.

    Parameters
    ----------
    unit : ShadingPipelineUnit or MergedPipelinesUnit
        The pipeline, or several with one stream of pixels.

    Returns
    -------
    dict of dict of int arrays
        For each of ``writes``, ``spans``, ``pixels`` and ``status``: a column of codes for each port, all of
        the same length. See `teapot_frame`.
    """
    several = isinstance(unit.model, PixelPipelines)
    spans, constants, pixels = teapot_frame(unit.model.design if several else unit.model)
    tables = {
        "writes": ("write", writes_of(constants)),
        "spans": ("i", beats_of(unit, spans)),
        "pixels": ("o", pixel_beats(pixels)),
        "status": (
            "status",
            {
                "out_of_range_spans": [pixels.out_of_range_spans],
                "empty_spans": [1],
                "overrun": [0],
            },
        ),
    }
    return {name: dict(_columns(*table)) for name, table in tables.items()}


def pixel_beats(pixels: Pixels) -> dict[str, np.ndarray]:
    """Output beats of a pipeline, as `pack` takes them."""
    beats = {"x": pixels.x, "y": pixels.y, "last": pixels.last}
    return beats | dict(zip("rgb", pixels.color.T, strict=True))


def _columns(name: str, beats) -> Iterator[tuple[str, np.ndarray]]:
    """Port and codes of every field of beats. The ports have the names of `emit`."""
    if np.ndim(beats) > 1:
        parts = ((index, beats[:, index]) for index in range(beats.shape[1]))
    elif isinstance(beats, Mapping):
        parts = beats.items()
    elif names := np.asarray(beats).dtype.names:
        parts = ((field, beats[field]) for field in names)
    else:
        yield name, np.asarray(beats, dtype=np.int64)
        return
    for key, part in parts:
        yield from _columns(f"{name}_{key}", part)


def check_folder(folder: str | os.PathLike) -> None:
    """Check that a bench can be written into a folder. The check writes nothing.

    Raises
    ------
    InputError
        If the folder exists and is not empty, or cannot be made or written.
    """
    if names := files_within(folder, _TEMPLATES[0]):
        raise InputError(str(folder), f"holds {names[0]} already", "give a new or empty folder")


def write_testbench(
    folder: str | os.PathLike,
    unit: ShadingPipelineUnit | MergedPipelinesUnit,
    name: str,
    text: str,
    about: Sequence[str],
) -> None:
    """Write a bench, its test vectors and the Verilog into a folder. Each file is whole or not there.

    Parameters
    ----------
    folder : path
        A new or an empty folder, see `check_folder`.
    unit : ShadingPipelineUnit or MergedPipelinesUnit
        The pipeline, or several with one stream of pixels.
    name, text : str
        Name of the top module, and Verilog of the pipeline.
    about : sequence of str
        Lines of README.md that describe the pipeline.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    folder = Path(folder)
    check_folder(folder)
    tables = vectors(unit)
    counts = {table: len(next(iter(columns.values()))) for table, columns in tables.items()}
    templates = resources.files(__package__) / "templates"
    readme = Template((templates / "README.md").read_text(encoding="utf-8"))
    width, height = _SIZE
    files = {f"{name}.v": text}
    files |= {name: (templates / name).read_text(encoding="utf-8") for name in _TEMPLATES}
    files |= {f"vectors/{table}.csv": _csv(columns) for table, columns in tables.items()}
    files["README.md"] = readme.substitute(
        counts, file=f"{name}.v", about="\n".join(f"- {line}" for line in about), width=width, height=height
    )
    (folder / "vectors").mkdir(parents=True, exist_ok=True)
    for path, content in files.items():
        write_text(folder / path, content)


def _csv(columns: Mapping[str, np.ndarray]) -> str:
    rows = np.column_stack(list(columns.values())).tolist()
    return "\n".join(",".join(map(str, row)) for row in [list(columns), *rows]) + "\n"
