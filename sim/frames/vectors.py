"""Test vectors of a core: a small frame of a teapot, as codes on the ports of its Verilog."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from blysk.golden.bus.registers import CONSTANTS, RegisterMap
from blysk.golden.bus.stream_width import split
from blysk.golden.cosines.quotient_lanes import pixels_of_beats
from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.frames.prepare import prepare
from blysk.golden.frames.triangle_frame import sent_triangles, triangle_constants
from blysk.golden.pipeline import Pixels, ShadingPipeline, Spans
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.golden.render import Renderer
from blysk.hdl.bus.bus import BusUnit
from blysk.hdl.emit.verilog import port_widths
from blysk.hdl.pixel_pipelines import PixelPipelinesUnit
from blysk.sim.frames.frame import beats_of, sample_material
from blysk.sim.meshes.teapot import teapot

__all__ = ["Table", "pixel_beats", "teapot_frame", "teapot_scene", "vectors"]

_SIZE = 64, 48
_TRIANGLES = 400

_SMALL = 32, 24
_FEW = 100
"""Size of the picture and number of triangles for cores with geometry, which are slower to simulate."""


@dataclass(frozen=True)
class Table:
    """Codes on some ports, a column for each port and a row for each transfer.

    Parameters
    ----------
    columns : mapping of str to sequence of int
        Codes by port, all of the same length. Codes of outputs are not negative.
    kind : {"set", "source", "sink", "access", "read"}
        ``set``: a row that stays on inputs. ``source``, ``sink``: a stream into or out of the core.
        ``access``: accesses on Wishbone. ``read``: a row that outputs have at the end.
    text : str
        Description of the rows.
    phase : int
        Number of the phase in which the transfers take place. A phase begins when the phase before has ended.
    valid, ready : str
        Ports of the handshake of a stream.
    """

    columns: Mapping[str, Sequence[int]]
    kind: str
    text: str
    phase: int = 0
    valid: str = ""
    ready: str = ""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))


@dataclass(frozen=True)
class _Frame:
    """A frame: beats of the core's own streams, frame constants, and the counters at its end."""

    given: Mapping[str, Any]
    made: Mapping[str, Any]
    writes: Mapping[str, np.ndarray] | None
    constants: Mapping[str, int]
    status: Mapping[str, int]
    lanes: Sequence[Mapping[str, Any]] = ()


def teapot_scene(
    design: ShadingPipeline, size: tuple[int, int] = _SIZE, triangles: int = _TRIANGLES
) -> Scene:
    """A teapot with as many lights and materials as a pipeline has. No term is too bright for the pipeline.

    Parameters
    ----------
    design : ShadingPipeline
        The pipeline.
    size : two ints
        Width and height of the picture.
    triangles : int
        Approximate number of triangles of the teapot.
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
    return Scene(
        mesh=replace(mesh, material=np.arange(len(mesh.faces)) % design.materials),
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, width / height),
        width=width,
        height=height,
        material=materials,
        lights=lights,
    )


def teapot_frame(
    design: ShadingPipeline, size: tuple[int, int] = _SIZE, triangles: int = _TRIANGLES
) -> tuple[Spans, list[FrameConstants], Pixels]:
    """The frame of `teapot_scene` by spans.

    Parameters
    ----------
    design, size, triangles
        As for `teapot_scene`.

    Returns
    -------
    spans : Spans
        The input. The first span has length 0, so it gives no pixel.
    constants : list of FrameConstants
        The constants of each material.
    pixels : Pixels
        The expected output, by the bit-accurate model.
    """
    prepared = prepare(teapot_scene(design, size, triangles), design)
    spans = prepared.spans
    spans = spans[np.r_[0, : len(spans)]]
    spans.length[0] = 0
    spans = design.sent(spans, prepared.constants)
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


def pixel_beats(pixels: Pixels, lanes: int = 1) -> dict[str, np.ndarray]:
    """Output beats of a pipeline, as `pack` takes them.

    Parameters
    ----------
    pixels : Pixels
        All pixels of its spans.
    lanes : int
        Lanes of the pipeline. With several lanes the beats have the fields of `beat_shape`.
    """
    if lanes == 1:
        beats = {"x": pixels.x, "y": pixels.y, "last": pixels.last}
        return beats | dict(zip("rgb", pixels.color.T, strict=True))
    length = np.diff(np.flatnonzero(np.r_[True, pixels.last]))
    index, present, _ = pixels_of_beats(length, lanes)
    colors = np.zeros(present.shape, [(name, np.uint8) for name in "rgb"])
    for name, channel in zip("rgb", pixels.color.T, strict=True):
        colors[name] = np.where(present, channel[index], 0)
    last = index[np.arange(len(index)), present.sum(axis=1) - 1]
    return {
        "x": pixels.x[index[:, 0]],
        "y": pixels.y[index[:, 0]],
        "present": (present << np.arange(lanes)).sum(axis=1),
        "colors": colors,
        "last": pixels.last[last],
    }


def vectors(design: ShadingPipeline, unit: Any) -> dict[str, Table]:
    """Inputs and expected outputs of a core for a small frame, by port of its Verilog.

    Parameters
    ----------
    design : ShadingPipeline
        The design, whose `Build` names the core.
    unit : Component
        The core, as `core_of` makes it.

    Returns
    -------
    dict of Table
        Tables by name. The names of the core's own output tables begin with ``pixels`` or ``spans``.
    """
    tables, widths = _tables(design, unit), port_widths(unit)

    def unsigned(port: str, codes: Sequence[int]) -> list[int]:
        return [code & (1 << abs(widths[port])) - 1 for code in codes]

    for name, table in tables.items():
        if table.kind in ("sink", "read"):
            columns = {port: unsigned(port, codes) for port, codes in table.columns.items()}
            tables[name] = replace(table, columns=columns)
    return tables


def _tables(design: ShadingPipeline, unit: Any) -> dict[str, Table]:
    core = unit.framing.core if isinstance(unit, BusUnit) else unit
    frame = _triangle_frame(design, core) if design.build.takes_triangles else _span_frame(design, core)
    if not isinstance(unit, BusUnit):
        return _native(design, unit, frame)
    registers = _wishbone if design.build.bus == "wishbone" else _axi_lite
    phases = registers(_register_writes(unit.map, frame), 0, ""), _bus_streams(design, unit, frame)
    reads = [(unit.map[name].address, code) for name, code in frame.status.items()]
    counters = [(unit.map["state"].address, 0), (unit.map["frames"].address, 1)]
    counters += [(unit.map[name].address, 0) for name in ("misfits", "errors")]
    return phases[0] | phases[1] | registers([*reads, *counters], 2, "counters")


def _span_frame(design: ShadingPipeline, core: Any) -> _Frame:
    spans, constants, pixels = teapot_frame(design)
    status = {"out_of_range_spans": pixels.out_of_range_spans, "empty_spans": 1, "overrun": 0}
    lanes: list[dict[str, np.ndarray]] = []
    made = pixel_beats(pixels, design.build.lanes)
    if isinstance(core, PixelPipelinesUnit):
        lanes = [pixel_beats(each) for each in core.model.compute_each(spans, constants)]
    return _Frame(beats_of(core, spans), made, writes_of(constants), {}, status, lanes)


def _triangle_frame(design: ShadingPipeline, core: Any) -> _Frame:
    renderer = Renderer(design)
    size = _SMALL
    if renderer.coarse is not None:
        size = min(size[0], renderer.coarse.width), min(size[1], renderer.coarse.height)
    scene = teapot_scene(design, size, _FEW)
    sent = sent_triangles(scene, renderer)
    constants = sent.frame.codes | {"picture": 0}
    constants = {name: constants[name] for name in core.constants.shape().members}
    triangles = sent.triangles
    if design.build.top == "geometry":
        spans, counts = renderer.geometry.compute(triangles, sent.frame)
        return _Frame(triangles.beats, spans.beats, None, constants, counts)
    of_materials = triangle_constants(scene, renderer)
    drawn = renderer.compute(triangles, sent.frame, of_materials)
    status = drawn.counts | {"out_of_range_spans": drawn.out_of_range_spans}
    return _Frame(triangles.beats, drawn.beats, writes_of(of_materials), constants, status)


_WHAT = {
    "shader": ("spans", "spans of a teapot; the first has length 0 and gives no pixel", "pixels"),
    "geometry": ("triangles", "triangles of a teapot", "spans"),
    "render": ("triangles", "triangles of a teapot", "pixels"),
}
"""For each core: name of its input, description of the input, name of its output."""


def _native(design: ShadingPipeline, unit: Any, frame: _Frame) -> dict[str, Table]:
    """Tables of a core with its own ports."""
    given, what, made = _WHAT[design.build.top]
    tables = {}
    if frame.constants:
        rows = {name: [code] for name, code in frame.constants.items()}
        tables["constants"] = Table(_columns("constants", rows), "set", "constants of the picture")
    if frame.writes is not None:
        tables["writes"] = _stream(
            "write", frame.writes, "source", "frame constants, in the order of writing"
        )
    tables[given] = _stream("i", frame.given, "source", what, 1)
    if frame.lanes:
        for k, lane in enumerate(frame.lanes):
            text = f"pixels of pipeline {k} that must come out, in this order"
            tables[f"{made}_{k}"] = _stream(f"o_{k}", lane, "sink", text, 1)
    else:
        tables[made] = _stream("o", frame.made, "sink", f"{made} that must come out, in this order", 1)
    status = {name: [code] for name, code in frame.status.items()}
    tables["status"] = Table(_columns("status", status), "read", f"the counters after the last of the {made}")
    return tables


def _stream(name: str, beats: Mapping[str, Any], kind: str, text: str, phase: int = 0) -> Table:
    return Table(_columns(name, beats), kind, text, phase, f"{name}_valid", f"{name}_ready")


def _register_writes(map: RegisterMap, frame: _Frame) -> list[tuple[int, int]]:
    """Writes of registers: address of a byte, word."""
    codes = frame.constants | ({"keep": 0} if "keep" in map.by_name else {})
    writes = [
        (map[name].address, map[name].extended(code)) for name, code in codes.items() if name != "picture"
    ]
    if frame.writes is not None:
        for address, code in zip(*(frame.writes[name].tolist() for name in ("address", "data")), strict=True):
            register = map.by_address[CONSTANTS + 4 * address]
            writes.append((register.address, register.extended(code)))
    return writes


def _axi_lite(accesses: Sequence[tuple[int, int]], phase: int, reads: str) -> dict[str, Table]:
    """Tables of accesses by AXI4-Lite: writes, or reads of ``reads`` with the expected words."""
    addresses, words = (list(part) for part in zip(*accesses, strict=True))
    count = len(accesses)

    def table(channel: str, kind: str, text: str, **columns: Sequence[int]) -> Table:
        ports = {f"s_axil_{name}": codes for name, codes in columns.items()}
        handshake = (f"s_axil_{channel}{name}" for name in ("valid", "ready"))
        return Table(ports, kind, text, phase, *handshake)

    if reads:
        return {
            "read_addresses": table("ar", "source", f"addresses of {reads}", araddr=addresses),
            "read_words": table("r", "sink", f"{reads} after the frame", rdata=words, rresp=[0] * count),
        }
    text = "registers of the picture, and frame constants"
    return {
        "write_addresses": table("aw", "source", f"addresses of {text}", awaddr=addresses),
        "write_words": table("w", "source", text, wdata=words, wstrb=[15] * count),
        "write_responses": table("b", "sink", "answers: 0 is OKAY", bresp=[0] * count),
    }


def _wishbone(accesses: Sequence[tuple[int, int]], phase: int, reads: str) -> dict[str, Table]:
    """Tables of accesses by Wishbone: writes, or reads of ``reads`` with the expected words."""
    columns = {
        "wb_adr": [address >> 2 for address, _ in accesses],
        "wb_we": [int(not reads)] * len(accesses),
        "wb_sel": [15] * len(accesses),
        "wb_dat_r" if reads else "wb_dat_w": [word for _, word in accesses],
    }
    text = f"{reads} after the frame" if reads else "registers of the picture, and frame constants"
    return {"reads" if reads else "writes": Table(columns, "access", text, phase)}


def _bus_streams(design: ShadingPipeline, unit: BusUnit, frame: _Frame) -> dict[str, Table]:
    """Tables of the input and the output of a core on a bus."""
    given, what, made = _WHAT[design.build.top]
    framing = unit.framing.model
    packed = framing.given.pack(framing.given.columns(frame.given))
    columns = framing.made.columns(frame.made) | (
        {"last": frame.made["last"]} if "last" in frame.made else {}
    )
    out = framing.compute(columns, np.zeros(len(next(iter(columns.values()))), dtype=int))
    taken = {"data": packed, "last": np.arange(1, len(packed) + 1) // len(packed)}
    if size := (design.build.stream or 0) // 8:
        taken, out = split(taken, size), split(out, size)
    count, size = out["data"].shape
    tables = {
        given: {"tdata": _words(taken["data"]), "tlast": taken["last"].tolist()},
        made: {
            "tdata": _words(out["data"]),
            "tkeep": [(1 << size) - 1] * count,
            "tlast": out["last"].tolist(),
            "tuser": (out["first"] + 2 * out["end"]).tolist(),
        },
    }
    kinds = (
        ("s_axis", "source", f"{what}: bytes, byte 0 lowest"),
        ("m_axis", "sink", f"{made} that must come out, in this order"),
    )
    return {
        name: Table(
            {f"{stream}_{port}": codes for port, codes in columns.items()},
            kind,
            text,
            1,
            f"{stream}_tvalid",
            f"{stream}_tready",
        )
        for (name, columns), (stream, kind, text) in zip(tables.items(), kinds, strict=True)
    }


def _words(data: np.ndarray) -> list[int]:
    """Whole numbers from the bytes of each row, byte 0 lowest."""
    return [int.from_bytes(row.tobytes(), "little") for row in data]


def _columns(name: str, beats: Any) -> dict[str, list[int]]:
    """Codes of every field of beats, by port. The ports have the names of `emit`."""
    return {port: codes.tolist() for port, codes in _leaves(name, beats)}


def _leaves(name: str, beats: Any) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(beats, Mapping):
        parts = beats.items()
    elif np.ndim(beats) > 1:
        parts = ((index, beats[:, index]) for index in range(beats.shape[1]))
    elif names := np.asarray(beats).dtype.names:
        parts = ((field, beats[field]) for field in names)
    else:
        return iter([(name, np.asarray(beats, dtype=np.int64))])
    return chain.from_iterable(_leaves(f"{name}_{key}", part) for key, part in parts)
