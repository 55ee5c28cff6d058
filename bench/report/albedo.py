"""The report's section on colours of pixels: errors of frames with vertex colours and textures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from blysk.bench.colors import style_of
from blysk.bench.report.section import Drawing, Grade, Section, Table
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.frames.border import BORDER
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.surface import design_for
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import FILTERS, Texture
from blysk.golden.reference.transfer import SPACES
from blysk.hdl.emit.cost import cost_of
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = ["COLORED", "GOAL", "SCENES", "STEEPEST", "measure", "multipliers", "scene_of", "section", "tasks"]

GOAL = 1.0
"""Largest error, in LSB of the frame's codes, that a pixel off the borders may have."""

_PROJECTIONS = "perspective", "orthographic"
_TRANSFERS = "linear", "srgb"
_CONTRASTS = 0.0, 0.25, 0.5, 0.75
_SIDE = 64


def _checker(square: int, mipmapped: bool) -> Texture:
    """Texels of 0 and 1 in squares."""
    texels = (np.indices((_SIDE, _SIDE)) // square).sum(axis=0) % 2
    return Texture(np.repeat(texels[..., np.newaxis], 3, axis=2), mipmapped=mipmapped)


def _floor(texture: Texture) -> tuple[Mesh, Texture]:
    """A floor of 5 by 15 images, with normals that are bent outwards."""
    corners = np.array([[-15.0, 0, 2], [15, 0, 2], [15, 0, -88], [-15, 0, -88]])
    normals = normalise(corners * (0.02, 0, 0.005) + (0, 1, 0.3))
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(corners, faces, normals, coordinates=corners[:, ::2] / 6), texture


def _shares(vertices: np.ndarray) -> np.ndarray:
    """Positions as shares of the box of the vertices, 0 to 1."""
    lowest = vertices.min(axis=0)
    shares: np.ndarray = (vertices - lowest) / (vertices.max(axis=0) - lowest)
    return shares


def _textured(triangles: int) -> tuple[Mesh, Texture]:
    """The teapot with texture coordinates along x and y, and a texture of random texels."""
    mesh = teapot(triangles)
    noise = Texture(np.random.default_rng(2).random((_SIDE, _SIDE, 3)))
    return replace(mesh, coordinates=2 * _shares(mesh.vertices)[:, :2]), noise


def _colored(triangles: int) -> tuple[Mesh, None]:
    """The teapot with vertex colours. The colour of a vertex is its position, as shares of the box."""
    mesh = teapot(triangles)
    return replace(mesh, colors=np.clip(_shares(mesh.vertices), 0, 1)), None


STEEPEST = "floor, squares of single texels, no levels"
"""Surface whose neighbouring texels differ most at every place."""

COLORED = "teapot, vertex colours"
"""Surface with vertex colours and no texture."""

_QUICK = STEEPEST, "teapot, random texels, levels"

SCENES: dict[str, Callable[[int], tuple[Mesh, Texture | None]]] = {
    "floor, squares of 8x8 texels, levels": lambda _: _floor(_checker(8, True)),
    "floor, squares of 8x8 texels, no levels": lambda _: _floor(_checker(8, False)),
    "floor, squares of single texels, levels": lambda _: _floor(_checker(1, True)),
    STEEPEST: lambda _: _floor(_checker(1, False)),
    "teapot, random texels, levels": _textured,
    COLORED: _colored,
}
"""Surfaces by name. Each function takes an approximate number of triangles of the teapot."""


def scene_of(name: str, filter: str | None, projection: str, contrast: float, size: Sequence[int]) -> Scene:
    """A scene of `SCENES` under one light.

    Parameters
    ----------
    name : str
        A key of `SCENES`.
    filter : str or None
        One of `FILTERS`; ``None`` for vertex colours.
    projection : str
        Projection of the camera.
    contrast : float
        Largest difference of texels, 0 to 1, around 1/2. For vertex colours it has no effect.
    size : sequence of int
        Width, height and triangles.
    """
    width, height, triangles = size
    mesh, texture = SCENES[name](triangles)
    if texture is None or name.startswith("teapot"):
        camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, width / height)
    else:
        # The camera is rolled, so that depths differ along a scanline.
        view: dict[str, Any] = {"up": (0.5, 1.0, 0.0), "height": 4.0, "field_of_view": 40.0}
        camera = Camera((1.0, 0.9, 5.0), (0.0, 0.0, -4.0), projection=projection, **view)
    if texture is not None:
        texels = 0.5 + contrast * (texture.texels - 0.5)
        texture = replace(texture, texels=texels, filter=filter or FILTERS[0])
    material = Material((0.05,) * 3, (0.6,) * 3, (0.3,) * 3, 20, texture=texture)
    return Scene(mesh, camera, width, height, material, [Light((-0.5, 0.8, 0.7))])


def _design(scene: Scene, transfer: str) -> ShadingPipeline:
    return replace(design_for(preset("quotient", "blinn"), scene), transfer=transfer)


def measure(
    name: str,
    filter: str | None,
    projection: str,
    contrast: float,
    transfer: str,
    size: Sequence[int],
    engine: str | None,
) -> dict[str, Any]:
    """Errors, bound and cycles of a frame by ``quotient``.

    Parameters
    ----------
    name, filter, projection, contrast, size
        As for `scene_of`.
    transfer : str
        One of `TRANSFERS`, of the frame.
    engine : str or None
        Engine that simulates the frame. ``None``: the bit-accurate model computes the same frame, and
        `frame_cycles` its cycles.

    Returns
    -------
    dict
        - ``error``, ``bound``: largest error off the borders (see `border_mask`), and its bound, in LSB of
          the frame's codes;
        - ``pixels``, ``border_pixels``: number of shown pixels, and number of shown pixels at a border;
        - ``border_error``: largest error at a border, in LSB;
        - ``cycles_per_pixel``: cycles without those of writes, divided by the shaded pixels;
        - ``writes``: writes of constants and texels.
    """
    scene = scene_of(name, filter, projection, contrast, size)
    design = _design(scene, transfer)
    frame = FrameSimulator(design, engine).render(scene) if engine else model_frame(scene, design)
    spans, writes = frame.prepared.spans, frame.prepared.writes
    cycles = frame.cycles - writes if engine else frame_cycles(unit_of(design), spans, 0)
    found = compare(scene, design, frame)
    return {
        "error": found.method_error.steady_lsb,
        "bound": found.bound_lsb,
        "pixels": found.visible_pixels,
        "border_pixels": found.border_pixels,
        "border_error": found.method_error.border_lsb,
        "cycles_per_pixel": cycles / frame.pixels,
        "writes": writes,
    }


def multipliers(parts: Sequence[str], transfer: str) -> int:
    """Multipliers of a pipeline with an albedo and one light, before synthesis.

    Parameters
    ----------
    parts : sequence of str
        Words of `Albedo.PARTS`.
    transfer : str
        One of `TRANSFERS`.
    """
    design = replace(preset("quotient", "blinn"), albedo=Albedo.of_parts(parts), transfer=transfer)
    return cost_of(unit_of(design)).multiplier_count


def _frames(quick: bool) -> list[dict[str, Any]]:
    """Settings of `measure`: each scene with each filter, projection and transfer, then further contrasts."""
    if quick:
        names, filters, projections, transfers = _QUICK, FILTERS[:1], _PROJECTIONS[:1], _TRANSFERS[-1:]
    else:
        names, filters, projections, transfers = tuple(SCENES), FILTERS, _PROJECTIONS, _TRANSFERS
    size = [160, 120, 1000] if quick else [320, 240, 2000]
    found = [
        {"name": name, "filter": filter, "projection": projection, "contrast": 1.0, "transfer": transfer}
        for name in names
        for filter in (filters if name != COLORED else (None,))
        for projection in projections
        for transfer in transfers
    ]
    if not quick:
        steepest = {"name": STEEPEST, "filter": "bilinear", "projection": "perspective"}
        found += [
            {**steepest, "contrast": contrast, "transfer": transfer}
            for contrast in _CONTRASTS
            for transfer in _TRANSFERS
        ]
    return [{**of, "size": size, "engine": None if quick else "cxxrtl"} for of in found]


def _design_of(frame: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of `multipliers` for a frame."""
    parts = [frame["filter"] or "colors"]
    parts += ["orthographic"] * (frame["projection"] == "orthographic")
    return {"parts": parts, "transfer": frame["transfer"]}


def tasks(quick: bool) -> list[Task]:
    """Measurements of frames, and of their designs. A quick report has two small frames of one design."""
    frames = _frames(quick)
    designs = {str(design): design for design in map(_design_of, frames)}
    return [Task(measure, of) for of in frames] + [Task(multipliers, of) for of in designs.values()]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: errors, bounds and costs of the frames, and errors against the contrast of texels."""
    frames, designs = [], {}
    for task, result in zip(tasks, results, strict=True):
        if task.function is measure:
            frames.append({**task.settings, **result})
        else:
            designs[str(task.settings)] = result
    full = [of for of in frames if of["contrast"] == 1]
    steepest = [of for of in frames if _is_steepest(of)]
    largest = {
        transfer: max(of["error"] for of in full if of["transfer"] == transfer)
        for transfer in dict.fromkeys(of["transfer"] for of in full)
    }
    worst = ", ".join(f"{error:.2f} LSB of {SPACES[transfer]}" for transfer, error in largest.items())
    within = sum(of["error"] <= GOAL for of in frames)
    proved = [of for of in frames if of["bound"] is not None]
    text = [
        "Vertex colours and textures give each pixel an albedo. The method is `quotient`, and the model is "
        "`blinn`, with one light and exponent 20. The checkers of the floor have texels of 0 and 1. The "
        "camera sees the floor at a grazing angle, and is rolled, so depths differ along a scanline. A "
        "full report also has a teapot with vertex colours: each colour is the position of its vertex.",
        f"The largest error off the borders is {worst}. The goal is {GOAL:g} LSB, and {within} of "
        f"{len(frames)} frames reach it. {len(proved)} of {len(frames)} frames have a proved bound. In "
        f"{sum(of['error'] <= of['bound'] for of in proved)} of these frames the error is within the bound.",
    ]
    parts: list[Table | Drawing] = [_table(full, designs)]
    if len({of["contrast"] for of in steepest}) > 1:
        parts.append(_drawing(steepest))
    return Section("albedo", "Colours of pixels", text, parts)


def _is_steepest(frame: Mapping[str, Any]) -> bool:
    kind = frame["name"], frame["filter"], frame["projection"]
    return kind == (STEEPEST, "bilinear", "perspective")


def _table(frames: Sequence[Mapping[str, Any]], designs: Mapping[str, int]) -> Table:
    columns = ("surface", "filter", "projection", "space", "largest error, LSB", "bound, LSB", "pixels")
    columns += (
        "pixels at a border",
        "largest error at a border, LSB",
        "cycles a pixel",
        "writes",
        "multipliers",
    )
    keys = ("error", "bound", "pixels", "border_pixels", "border_error", "cycles_per_pixel", "writes")
    rows, grades = [], []
    for of in frames:
        rows.append(
            (
                *(of["name"], of["filter"], of["projection"], SPACES[of["transfer"]]),
                *(of[key] if key != "border_error" or of["border_pixels"] else None for key in keys),
                designs[str(_design_of(of))],
            )
        )
        good = of["error"] <= min(GOAL, of["bound"] or GOAL)
        grade: Grade = "good" if good else "bad"
        grades.append([grade if column == "largest error, LSB" else "" for column in columns])
    width, height, triangles = frames[0]["size"]
    counted = "simulated" if frames[0]["engine"] else "computed from the lengths of spans"
    note = (
        f"Frames of {width}x{height} pixels, against exact normals and the same filter in float64. An LSB is "
        "a step of the codes in the row's space. An error is green if it is at most "
        f"{GOAL:g} LSB and within its bound, else red. Pixels at a border are left out of the error and of "
        f"the bound: |N.L| is at most {BORDER:g} there, or with `nearest` another texel begins within "
        f"{BORDER:g} texels. The teapot has about {triangles:,} triangles. Cycles are {counted}, without "
        "those of writes. Writes of texels are needed only for another texture. Multipliers are counted "
        "before synthesis."
    )
    return Table("albedo-errors", "Errors with vertex colours and textures", columns, rows, note, grades)


def _drawing(frames: Sequence[Mapping[str, Any]]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels = figure.subplots(1, len(_TRANSFERS), sharex=True)
    style = style_of("quotient")
    for panel, transfer in zip(panels, _TRANSFERS, strict=True):
        shown = sorted(
            (of["contrast"], of["error"], of["bound"]) for of in frames if of["transfer"] == transfer
        )
        contrast, error, bound = zip(*shown, strict=True)
        panel.plot(contrast, bound, color="#6e6e6e", linestyle="--", linewidth=1.4, label="bound")
        panel.plot(
            contrast, error, color=style.color, marker=style.marker, linewidth=1.4, label="largest error"
        )
        panel.set(title=SPACES[transfer], xlabel="contrast of texels")
        panel.grid(True, color="#dddddd", linewidth=0.5)
        panel.title.set_fontsize(9)
    panels[0].set_ylabel("error, LSB")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    note = (
        f"Surface: {STEEPEST}, `bilinear`, in perspective. Texels lie around 1/2, and differ by at most the "
        "contrast. In linear light the bound rises in a straight line with the contrast. In sRGB the bound "
        "also rises because the curve is steeper for darker texels."
    )
    return Drawing(
        "albedo-contrast", "Largest error and bound against the contrast of texels", svg(figure), note
    )
