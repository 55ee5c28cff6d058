"""``blysk web``: a static site in which a browser simulates the pipeline, clock by clock, as WebAssembly.

Everything that the page knows of formats, addresses, models and words comes from the Python objects, as
JSON. Data and modules are scripts, loaded when they are wanted: a page from disk may load nothing else.
"""

import base64
import importlib.util
import inspect
import json
import posixpath
import re
import shutil
import tempfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import click
import numpy as np

from blysk.bench import accuracy
from blysk.bench.command import resumable
from blysk.bench.report.cosine_quadratic import sphere
from blysk.bench.report.points import STEPS, map_colors
from blysk.bench.report.report import (
    SECTIONS,
    about,
    chosen_tasks,
    embedded,
    environment,
    measure_all,
    measured,
    write_report,
)
from blysk.bench.store import Task, version_of
from blysk.bench.tools.pages import PROJECT
from blysk.golden.frame_constants import FIELDS_OF_A_FRAME, FIELDS_OF_A_LIGHT, LIGHT_STRIDE
from blysk.golden.frames.prepare import prepare
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.pipeline import Design, Spans
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.reflection import (
    REFLECTION_MODELS,
    AngleCosine,
    PolynomialModel,
    PowerModel,
)
from blysk.golden.reference.scene import Scene
from blysk.sim.cli.main import Whole
from blysk.sim.engines.engine import StopReason
from blysk.sim.engines.probes import ObservedPipeline, probes_of
from blysk.sim.engines.wasm import build, format_of, ports_of
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import turntable
from blysk.sim.frames.workers import processors
from blysk.sim.meshes.teapot import teapot
from blysk.sim.output import atomic_writer, files_within, write_json, write_text

__all__ = [
    "BANDS",
    "COLUMNS",
    "DESIGNS",
    "HEIGHT",
    "MESHES",
    "REFERENCES",
    "START",
    "WIDTH",
    "Body",
    "check_folder",
    "command",
    "design_of",
    "encode",
    "model_table",
    "module_of",
    "scene_of",
    "streams_of",
    "tables",
    "tasks",
    "write_site",
]

WIDTH, HEIGHT = 320, 240
"""Of the pictures."""

BANDS = (100, MAX_EXPONENT)
"""Spans are cut for these exponents; a frame has those of the smallest that is not under its own."""

DESIGNS = tuple(pair for pair in accuracy.DESIGNS if not preset(pair[0]).takes_values)
"""Method and model of each module. Where spans carry values of the light, it cannot be moved without them."""

BACKGROUND = "#1a1c20"

START = {
    "mesh": "teapot",
    "view": 0,
    "method": "chord",
    "model": "cosquad",
    "reference": "method",
    "direction": [-0.5, 0.8, 0.7],
    "exponent": 50,
    "ambient": 0.08,
    "diffuse": 0.75,
    "specular": 0.6,
    "color": "#ff8f44",
    "light": "#ffffff",
}
"""What the page shows first."""

REFERENCES = {
    "method": {
        "title": "exact normals, same model",
        "text": "Normals interpolated along the spans and brought to unit length exactly, with the same "
        "reflection model: the error of the method and of its arithmetic.",
        "curve": "normalised",
        "model": None,
    },
    "arithmetic": {
        "title": "same method and model",
        "text": "The same method and model in float64: what the words' widths cost. 0.5 LSB is correct "
        "rounding.",
        "curve": None,
        "model": None,
    },
    "total": {
        "title": "exact normals, Blinn's power",
        "text": "Exact normals along the spans, with the power that the reflection model stands for.",
        "curve": "normalised",
        "model": "blinn",
    },
}
"""What the frame is held against; ``None``: the design's own."""

_MARK = "site.json"
_PAGE = "index.html"
_EXTRAS = ("ziglang", "jinja2", "markdown_it", "flip_evaluator", "skimage")


# What is drawn.


@dataclass(frozen=True)
class Body:
    """A mesh of the page.

    Parameters
    ----------
    title : str
        What it is called.
    make : callable
        Makes it.
    views : int
        Cameras of the turntable.
    margin : float
        See `Camera.framing`.
    """

    title: str
    make: Callable[[], Mesh]
    views: int
    margin: float = 0.05


def _square() -> Mesh:
    """Two triangles with normals that bend outwards: spans from side to side."""
    corners = np.array([(x, y, 0.0) for y in (-1, 1) for x in (-1, 1)])
    return Mesh(corners, np.array([(0, 1, 3), (0, 3, 2)]), normalise(corners * 0.3 + (0, 0, 1)))


MESHES = {
    "teapot": Body("Utah teapot", lambda: teapot(3000), 8),
    "sphere": Body("sphere", lambda: sphere(24), 1, 0.15),
    "square": Body("bent square", _square, 8, 0.1),
}
"""Meshes of the page, by name."""


def design_of(method: str, model: str) -> Design:
    """The pipeline of a module: one light, and a highlight gate."""
    return preset(method, model, gate=True)


@cache
def _cameras(mesh: str) -> list[Camera]:
    body = MESHES[mesh]
    camera = Camera.framing(
        body.make().vertices, (0.4, 0.5, 1.0), "perspective", WIDTH / HEIGHT, margin=body.margin
    )
    return turntable(camera, body.views)


def _channels(color: str) -> tuple[float, ...]:
    return tuple(int(color[k : k + 2], 16) / 255 for k in (1, 3, 5))


def scene_of(settings: Mapping[str, Any]) -> Scene:
    """Scene of the page's settings.

    Parameters
    ----------
    settings : mapping
        As `START`.
    """
    color = np.array(_channels(settings["color"]))
    return Scene(
        mesh=MESHES[settings["mesh"]].make(),
        camera=_cameras(settings["mesh"])[settings["view"]],
        width=WIDTH,
        height=HEIGHT,
        material=Material(
            tuple(settings["ambient"] * color),
            tuple(settings["diffuse"] * color),
            (settings["specular"],) * 3,
            settings["exponent"],
        ),
        lights=[Light(tuple(settings["direction"]), _channels(settings["light"]))],
        background=_channels(BACKGROUND),
    )


# Data of the page.

COLUMNS = (
    *({"name": name, "bytes": 2, "bias": 1 << 15, "running": True} for name in ("x", "y")),
    {"name": "length", "bytes": 2, "bias": 0},
    *({"name": f"normal_left.{c}", "bytes": 3, "bias": 1 << 17} for c in range(3)),
    *(
        {"name": f"normal_right.{c}", "bytes": 3, "bias": 1 << 18, "from": f"normal_left.{c}"}
        for c in range(3)
    ),
)
"""Codes of the spans in a file, a column a field: as they are, or the change from the span before
(``running``) or from another column (``from``); plus ``bias``, so that none is negative; in so many
``bytes``."""


def encode(spans: Spans, visible: np.ndarray) -> bytes:
    """Spans of a view, and which of their fragments show, as bytes.

    Two counts in 32 bits, of spans and fragments; `COLUMNS`, the lowest byte of all codes first; a bit a
    fragment, the first lowest. Compressed by zlib.

    Parameters
    ----------
    spans : Spans
        With normals.
    visible : bool array
        Of the fragments in their order.
    """
    codes = {"x": spans.x, "y": spans.y, "length": spans.length}
    for c in range(3):
        codes |= {f"normal_left.{c}": spans.normal_left[:, c], f"normal_right.{c}": spans.normal_right[:, c]}
    parts = [np.array([len(spans), len(visible)], dtype="<u4").tobytes()]
    for column in COLUMNS:
        values = np.asarray(codes[column["name"]], dtype=np.int64)
        if "from" in column:
            values = values - codes[column["from"]]
        elif "running" in column:
            values = np.diff(values, prepend=0)
        split = (values + column["bias"]).astype("<u4").view(np.uint8).reshape(-1, 4)
        parts += [split[:, byte].tobytes() for byte in range(column["bytes"])]
    parts.append(np.packbits(visible, bitorder="little").tobytes())
    return zlib.compress(b"".join(parts), 9)


def streams_of(mesh: str, view: int, methods: Sequence[str]) -> dict[str, Any]:
    """Spans of a view for methods and `BANDS` of exponents.

    Parameters
    ----------
    mesh : str
        Of `MESHES`.
    view : int
        Of its turntable.
    methods : sequence of str
        Of `METHODS`.

    Returns
    -------
    dict
        ``axes``: of the camera, to the right, up, and to the viewer; ``streams``: for each method a number
        for each of the bands; ``data``: `encode`, in base 64, by those numbers.
    """
    camera = _cameras(mesh)[view]
    found: list[str] = []
    streams: dict[str, list[int]] = {}
    cuts: dict[tuple, int] = {}
    for method in methods:
        design = preset(method)
        streams[method] = []
        for exponent in BANDS:
            cut = design.interpolator.widest_span(exponent), design.interpolator.largest_deviation(exponent)
            if cut not in cuts:
                frame = prepare(scene_of(START | {"mesh": mesh, "view": view, "exponent": exponent}), design)
                text = base64.b64encode(encode(frame.spans, frame.cut_raster.visible)).decode()
                if text not in found:
                    found.append(text)
                cuts[cut] = found.index(text)
            streams[method].append(cuts[cut])
    axes = [*camera.axes[:2].tolist(), camera.viewer.tolist()]
    return {"axes": axes, "streams": streams, "data": found}


def module_of(method: str, model: str) -> dict[str, Any]:
    """The WebAssembly module of a pipeline, and what must be known to use it.

    Parameters
    ----------
    method, model : str
        Of `METHODS` and `MODELS`.

    Returns
    -------
    dict
        ``wasm``, compressed by zlib, in base 64, and its ``bytes``; ``ports``: see `ports_of`;
        ``probes``: those of `probes_of`; ``stages``: names, titles and ages at which a pixel comes
        and goes.
    """
    component = ObservedPipeline(design_of(method, model))
    binary, ports, probes = build(component), ports_of(component), probes_of(component.unit)
    ages = {probe.name: probe.age for probe in probes}
    first, lit, done = min(0, *ages.values()), ages["diffuse"], ages["r"]
    stages = (
        ("interpolator", "Interpolator: normals, or N·L and N·H", first - 1, 0),
        ("light", "Light: diffuse and specular term", 0, lit),
        ("intensity", "Intensity: products and sums", lit, done - 1),
        ("output", "Pixel", done - 1, done),
    )
    return {
        "wasm": base64.b64encode(zlib.compress(binary, 9)).decode(),
        "bytes": len(binary),
        "ports": ports,
        "probes": [
            {name: getattr(probe, name) for name in ("name", "title", "block", "age", "exact", "unit")}
            for probe in probes
        ],
        "stages": [dict(zip(("name", "title", "from", "to"), stage, strict=True)) for stage in stages],
    }


@cache
def model_table(model: str) -> dict[str, Any]:
    """What float64 needs of a reflection model: its ``kind``; slopes or scales for exponents 1 to 1000."""
    exponents = range(1, MAX_EXPONENT + 1)
    unit, reflection = MODELS[model], REFLECTION_MODELS[model]
    if isinstance(reflection, PowerModel):
        return {"kind": "power"}
    if isinstance(reflection, PolynomialModel):
        slopes = [reflection.slope(exponent) for exponent in exponents]
        return {"kind": "line", "power": 1 << unit.squarings, "slopes": slopes}
    found = {"slopes": unit.slopes.values[1 : MAX_EXPONENT + 1].tolist()}
    if isinstance(reflection, AngleCosine):
        scales = [reflection.scale(exponent) for exponent in exponents]
        return found | {"kind": "coscos", "power": reflection.power, "scales": scales}
    return found | {"kind": "exp"}


def tables() -> dict[str, Any]:
    """Formats and addresses of the frame constants, as JSON."""
    return {
        "one": ONE,
        "component": format_of(COMPONENT),
        "color": format_of(Intensity.COLOR_FORMAT),
        "frame": FIELDS_OF_A_FRAME,
        "light": FIELDS_OF_A_LIGHT,
        "stride": LIGHT_STRIDE,
        "done": int(StopReason.DONE),
    }


def _method(name: str) -> dict[str, Any]:
    """What the page needs of a method."""
    interpolator = METHODS[name]
    text = inspect.getdoc(type(interpolator)).split("\n\n")[0]
    return {"curve": interpolator.CURVE, "chord": interpolator.uses_chord, "text": " ".join(text.split())}


# The site.


def _missing() -> None:
    """Refuse to begin without what the extra brings."""
    for name in _EXTRAS:
        if importlib.util.find_spec(name) is None:
            raise InputError("web", f"{name} is not installed", "pip install 'blysk[web]'")


def _read(name: str) -> str:
    package = __package__ if name.startswith("web/") else "blysk.bench.report"
    return resources.files(package).joinpath("templates", *name.split("/")).read_text(encoding="utf-8")


def _script(name: str, value: Any) -> str:
    """A script that hands a value to the page."""
    return f"blysk.given({embedded(name)},{embedded(value)});\n"


_LINK = re.compile(r'<a href="([^"#:]+)(#[^"]*)?">(.*?)</a>', re.DOTALL)


def _device_pages(folder: Path) -> dict[str, str]:
    """Pages of the devices as HTML, by file; links that lead out of the folder are taken away."""
    from markdown_it import MarkdownIt

    markdown = MarkdownIt("commonmark").enable("table")
    template = environment().get_template("web/device.html")
    names = sorted(path.stem for path in folder.glob("*.md"))

    def link(match: re.Match) -> str:
        address, place, text = match[1], match[2] or "", match[3]
        if "/" in address or not (folder / address).exists():
            return text
        stem, dot, suffix = address.rpartition(".")
        page = "index" if stem == "README" else stem
        return f'<a href="{page}.html{place}">{text}</a>' if dot and suffix == "md" else match[0]

    found = {}
    for name in names:
        text = (folder / f"{name}.md").read_text(encoding="utf-8")
        title = re.search(r"^# (.+)$", text, re.MULTILINE)
        body = _LINK.sub(link, markdown.render(text))
        body = body.replace("<img ", '<img loading="lazy" ')
        body = body.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")
        file = "index" if name == "README" else name
        found[f"blocks/{file}.html"] = template.render(title=title[1] if title else name, body=body)
    return found


def _earlier(folder: Path) -> dict[str, Any] | None:
    """The mark of a folder, if it is a site of ours."""
    try:
        mark = json.loads((folder / _MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(mark, dict) or mark.get("program") != "blysk":
        return None
    names = mark.get("files")
    return mark if isinstance(names, list) and all(isinstance(name, str) for name in names) else None


def check_folder(folder: Path) -> None:
    """Check, before long work, that a site can be written into a folder; writes nothing.

    Parameters
    ----------
    folder : Path
        It is new, empty, or holds an earlier site.

    Raises
    ------
    InputError
        If it is a file, holds anything else, or may not be written.
    """
    names = files_within(folder, _PAGE)
    mark = _earlier(folder)
    ours = {_MARK, *(mark["files"] if mark else ())}
    others = [name for name in names if name not in ours]
    if others:
        reason = f"holds {others[0]}, which is of no site"
        raise InputError(str(folder), reason, "give a new or empty folder, or that of an earlier site")


def _report_files(folder: Path) -> list[Path]:
    """Files of a report, or one line that says that it is none."""
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        names = report["files"] if report["program"] == "blysk" else []
    except (OSError, ValueError, KeyError, TypeError):
        names = []
    files = [folder / name for name in names if Path(name).name == name]
    if not files or not all(path.is_file() for path in files):
        raise InputError(f"--report {folder}", "is no report", "make one with `blysk bench FOLDER`")
    return files


def tasks(designs: Sequence[tuple[str, str]], views: Mapping[str, int]) -> list[Task]:
    """What has to be made for a site: modules, then spans.

    Parameters
    ----------
    designs : sequence of (method, model)
        Of the modules.
    views : mapping
        Number of views by mesh.
    """
    methods = list(dict.fromkeys(method for method, _ in designs))
    found = [Task(module_of, {"method": method, "model": model}) for method, model in designs]
    found += [
        Task(streams_of, {"mesh": mesh, "view": view, "methods": methods})
        for mesh, count in views.items()
        for view in range(count)
    ]
    return found


def write_site(
    folder: Path, tasks: Sequence[Task], results: Sequence[Any], report: Path | None = None
) -> None:
    """Write the site. Each file is whole or not there; files of an earlier site that this has not got go.

    Parameters
    ----------
    folder : Path
        New, or see `check_folder`.
    tasks, results : sequences
        From `tasks`, and what they give.
    report : Path, optional
        Folder of a report, which becomes part of the site.

    Raises
    ------
    InputError
        If a file cannot be written, or the report is none.
    """
    check_folder(folder)
    made = _read("web/core.js") + _read("web/worker.js") + _read("web/app.js")
    files: dict[str, str] = {
        "style.css": _read("report.css") + _read("web/site.css"),
        "blysk.js": made,
    }
    designs, meshes = {}, {}
    for task, result in zip(tasks, results, strict=True):
        if task.function is module_of:
            name = "{method}-{model}".format(**task.settings)
            files[f"modules/{name}.js"] = _script(name, result)
            designs[name] = task.settings | {"bytes": result["bytes"]}
        else:
            mesh, view = task.settings["mesh"], task.settings["view"]
            names = [f"{mesh}-{view}-{number}" for number in range(len(result["data"]))]
            files |= {
                f"spans/{name}.js": _script(name, data)
                for name, data in zip(names, result["data"], strict=True)
            }
            streams = {method: [names[k] for k in numbers] for method, numbers in result["streams"].items()}
            entry = meshes.setdefault(mesh, {"title": MESHES[mesh].title, "views": []})
            entry["views"].append({"axes": result["axes"], "streams": streams})
    models = dict.fromkeys([*(design["model"] for design in designs.values()), "blinn"])
    for model in models:
        files[f"models/{model}.js"] = _script(f"model-{model}", model_table(model))
    blocks = PROJECT / "docs" / "blocks"
    pictures: dict[str, Path] = {}
    if blocks.is_dir():
        files |= _device_pages(blocks)
        pictures |= {f"blocks/{path.name}": path for path in sorted(blocks.glob("*.svg"))}
    if report is not None:
        pictures |= {f"report/{path.name}": path for path in _report_files(report)}
    first = next(iter(designs.values()))
    start = START | {"mesh": next(iter(meshes)), "method": first["method"], "model": first["model"]}
    if any(START["method"] == d["method"] and START["model"] == d["model"] for d in designs.values()):
        start |= {"method": START["method"], "model": START["model"]}
    if START["mesh"] in meshes:
        start |= {"mesh": START["mesh"]}
    site = {
        "width": WIDTH,
        "height": HEIGHT,
        "bands": BANDS,
        "columns": COLUMNS,
        "tables": tables(),
        "background": BACKGROUND,
        "start": start,
        "references": REFERENCES,
        "designs": designs,
        "meshes": meshes,
        "methods": {name: _method(name) for name in dict.fromkeys(d["method"] for d in designs.values())},
        "errorMap": {"limits": STEPS, "colors": map_colors()},
        "mostExponent": MAX_EXPONENT,
    }
    page = (
        environment()
        .get_template("web/index.html")
        .render(
            site=site,
            models=[model for model in MODELS if any(d["model"] == model for d in designs.values())],
            version=version_of("blysk"),
            has_blocks=blocks.is_dir(),
            has_report=report is not None,
            modules=len(designs),
        )
    )
    earlier = _earlier(folder) or {"files": []}
    everything = [*files, *pictures, _PAGE]
    folder.mkdir(exist_ok=True)
    # First: it tells that the folder is ours, whatever comes between.
    known = list(dict.fromkeys([*everything, *earlier["files"]]))
    write_json(folder / _MARK, {"program": "blysk", "version": version_of("blysk"), "files": known})
    for name in sorted({posixpath.dirname(name) for name in everything} - {""}):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_text(folder / name, text)
    for name, path in pictures.items():
        with atomic_writer(folder / name) as temporary:
            shutil.copyfile(path, temporary)
    write_text(folder / _PAGE, page)
    for name in set(earlier["files"]) - set(everything):
        if ".." not in Path(name).parts and not Path(name).is_absolute():
            (folder / name).unlink(missing_ok=True)
    write_json(folder / _MARK, {"program": "blysk", "version": version_of("blysk"), "files": everything})


# The command.


class _Design(click.ParamType):
    """A method and a model with a stroke between them."""

    name = "METHOD/MODEL"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        method, _, model = value.partition("/")
        served = [name for name in METHODS if METHODS[name].serves_gate]
        if method not in served:
            raise InputError(f"--design {value}", "unknown method", f"use one of {', '.join(served)}")
        if model not in MODELS:
            raise InputError(f"--design {value}", "unknown model", f"use one of {', '.join(MODELS)}")
        return method, model


@click.command(short_help="A site in which a browser simulates the pipeline.")
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(path_type=Path),
    default="site",
    show_default=True,
    help="Folder of the site; it is made, or an earlier site in it replaced.",
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="A report by `blysk bench`, in place of the quick one that is measured for the site.",
)
@click.option(
    "--design",
    "designs",
    type=_Design(),
    multiple=True,
    help=f"A module of this method and model alone; repeat for more.  [default: {len(DESIGNS)} of them]",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=processors,
    show_default="number of cores",
    help="Processes that compile.",
)
def command(folder, report, designs, jobs):
    """Write a static site: the pipeline as WebAssembly, simulated live while the light is moved.

    The page index.html opens from disk and from any web server, and asks for nothing but the site's own
    files. With it come the report of error against run time and the pages of the devices. A first time takes
    some minutes; modules, spans and measurements are kept in the cache, and made again when the code has
    changed.

    \b
    Example:
        blysk web -o site
        blysk web -o site --report report
    """
    check_folder(folder)
    if report is not None:
        _report_files(report)
    _missing()
    work = tasks(designs or DESIGNS, {name: body.views for name, body in MESHES.items()})
    chosen = chosen_tasks(quick=True) if report is None else []
    total = len(work) + sum(len(own) for _, own in chosen)
    with resumable(total, "parts") as count, tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        results = measure_all(work, jobs, count)
        if report is None:
            report = Path(temporary, "report")
            write_report(report, measured(chosen, jobs, count), about(True, (), list(SECTIONS)))
        write_site(folder, work, results, report)
    click.echo(f"{'site':<12}{folder / _PAGE}")
