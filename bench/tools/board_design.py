"""Design for a board: a scene, its presets for the buttons, and the top component with the board's pins."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from amaranth.hdl import Cat, ClockDomain, Elaboratable, Module
from amaranth.lib import io
from amaranth.lib.wiring import Component
from scipy.spatial.transform import Rotation

from blysk.bench.tools.board_loader import connect_loader
from blysk.bench.tools.board_options import COLOURS, DEFAULT_COLOURS, DEFAULTS
from blysk.bench.tools.boards import Board
from blysk.golden.albedo.texel_memory import BANKS
from blysk.golden.frames.frame import background_code
from blysk.golden.frames.surface import fixed_albedo_of, one_level
from blysk.golden.geometry.triangles import GRID
from blysk.golden.gpu import Gpu
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.golden.video.band_buffer import BandBuffer
from blysk.golden.video.clock_plan import ClockPlan
from blysk.golden.video.controls import Controls
from blysk.golden.video.display_timing import VGA
from blysk.golden.video.draw_unit import Drawing
from blysk.golden.video.mesh_memory import MeshMemory, block_rams
from blysk.golden.video.serialiser import LANES
from blysk.golden.video.triangle_assembly import screen_bits
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.video.clocks import ClockUnit
from blysk.hdl.video.output_cells import OutputCells
from blysk.sim.api.design import design_of
from blysk.sim.api.options import DESIGN, SCENE
from blysk.sim.api.scene import load, scenes_of, warn_of_ignored, without_albedo
from blysk.sim.api.settings import Settings, read_settings
from blysk.sim.errors import InputError
from blysk.sim.meshes.loaded_mesh import LoadedMesh

__all__ = ["BoardTop", "gpu_of", "least_cycles"]

_COMPACT_INTERVAL = 9
"""Setup interval on a small device.

With this interval ``renormalise`` takes 2 multipliers fewer than with interval 3.
"""

MAX_LIGHTS = 4
"""Largest number of lights of a board's scene."""

_SHINIER = 4
"""Exponent of the second material, as a multiple of the exponent of the first material."""

_RENDERER_BLOCKS = {"compact": 14, "throughput": 46}
"""Block RAMs of the renderer's tables and buffers, command lists and motion, by the style of geometry."""

_SURFACE_BLOCKS = {
    "compact": {(True, False): 1},
    "throughput": {(True, False): 15, (False, True): 14, (True, True): 24},
}
"""Further block RAMs with vertex colours and textures, by the style, without texels and mesh.

The keys tell whether there are colours and textures.
"""

_LEAST_SIDE = 16
"""Smallest side to which a larger texture is reduced."""

_TRANSFER_BLOCKS = 2
"""Block RAMs of the table of sRGB, with a port for each channel."""


def gpu_of(
    board: Board,
    mesh: str,
    given: Mapping[str, Any],
    colours: str = DEFAULT_COLOURS,
    lines: int | None = None,
) -> tuple[Gpu, list[Scene]]:
    """The drawing of a mesh on a board, and the scenes of its presets.

    The presets combine two materials with two positions of the lights. The materials are the given material,
    and the same material with four times the exponent. The lights are the given lights, or the given lights
    turned by a quarter around the up direction.

    Vertex colours and textures are drawn if the board has room for them. A small device draws no textures. If
    a mesh with colours does not fit it, its bands have half as many lines, and a warning says so. A larger
    image is halved until it fits. A warning names everything that is left out.

    Parameters
    ----------
    board : Board
        Board with the memory for the mesh.
    mesh : str
        File, scene file, or ``teapot``.
    given : dict
        Options of `OPTIONS`.
    colours : str
        A key of `COLOURS`.
    lines : int, optional
        Lines of a band. By default as many as fit.

    Raises
    ------
    InputError
        If the mesh cannot be read, or does not fit, or an option is not accepted.
    """
    settings = read_settings(mesh, given, {**SCENE, **DESIGN}, **DEFAULTS)
    with settings.located():
        if settings["size"] != VGA.size:
            raise settings.refuse("size", "the display has 640x480 pixels", "leave it out", "")
        loaded = load(settings, lights=MAX_LIGHTS, local=False, cutoffs=False)
        bits, given_lines = COLOURS[colours], lines
        try:
            scene, design, lines, less = _fitted(board, settings, loaded, bits, lines)
        except _NoRoom as error:
            loaded, lines, less = without_albedo(loaded, str(error)), lines or board.lines, ""
            (scene,) = scenes_of(loaded, settings)
            design = _design(settings, scene, board)
        warn_of_ignored(replace(loaded, ignored=(*loaded.ignored, *([less] if less else []))))
        if given_lines is None and lines < board.lines:
            text = f"{loaded.name} is drawn in bands of {lines} lines, because its colours take block RAMs"
            remedy = "bands may be late at 60 Hz; count them with --simulate, or give --materials one"
            warnings.warn(f"{text}; {remedy}", RuntimeWarning, stacklevel=2)
    scenes = _presets(scene, settings["up"])
    red, green, blue = background_code(scene, design.transfer).tolist()
    buffer = BandBuffer(VGA, lines, colour_bits=bits, background=(red, green, blue))
    _check_memory(board, mesh, scene, design, bits, lines)
    try:
        drawing = Drawing.of(
            scenes, design, lines=buffer.lines, axis=settings["up"], controls=Controls(materials=2, lights=2)
        )
    except ValueError as error:
        reason, _, remedy = str(error).partition("; ")
        remedy = remedy or "use another mesh, camera or material"
        raise InputError(f"--mesh {mesh}", reason, remedy) from error
    return Gpu(drawing, buffer), scenes


def _design(settings: Settings, scene: Scene, board: Board) -> ShadingPipeline:
    """The shading pipeline of the settings, for the lights and materials of a scene."""
    if scene.local:
        reason = "a board has only lights and a viewer at infinity"
        raise settings.refuse("lights", reason, "give directions of lights, and a distant viewer", "")
    if len(scene.lights) > MAX_LIGHTS:
        raise settings.refuse("lights", f"{len(scene.lights)} lights", f"give at most {MAX_LIGHTS}", "")
    made = design_of(settings, max(1, len(scene.lights)), len(scene.materials)).built(top="render")
    try:
        Renderer(made)
    except ValueError as error:
        reason, _, remedy = str(error).partition("; ")
        raise settings.refuse("method", reason, remedy) from None
    intervals = unit_of(made.interpolator).setup_intervals(made.interpolator)
    if board.compact and settings["setup_interval"] is None and _COMPACT_INTERVAL in intervals:
        made = made.built(setup_interval=_COMPACT_INTERVAL)
    return made.built(geometry_style="compact") if board.compact else made


def _presets(scene: Scene, up: Any) -> list[Scene]:
    """Presets: two positions of the lights, each with two materials. The materials change first."""
    shiny = tuple(
        replace(material, exponent=min(_SHINIER * material.exponent, MAX_EXPONENT))
        for material in scene.materials
    )
    # A light along the up direction does not change when it is turned.
    quarter = Rotation.from_rotvec(np.pi / 2 * normalise(up))
    lights = tuple(light.turned(quarter.apply) for light in scene.lights)
    return [
        replace(scene, material=material, lights=light)
        for light in (scene.lights, lights)
        for material in (scene.material, shiny)
    ]


class _NoRoom(Exception):
    """The board has no room for vertex colours and textures. The message is the reason."""


def _fitted(
    board: Board,
    settings: Settings,
    loaded: LoadedMesh,
    bits: tuple[int, int, int],
    lines: int | None,
) -> tuple[Scene, ShadingPipeline, int, str]:
    """Scene, design and lines of a band for a mesh with its vertex colours and textures.

    A text about smaller images comes last. If ``lines`` are given, a band has as many.

    Raises
    ------
    _NoRoom
        If the board or the method has no room for them.
    """
    (scene,) = scenes_of(loaded, settings)
    design = _design(settings, scene, board)
    if not scene.has_albedo:
        return scene, design, lines or board.lines, ""
    if scene.textures and board.compact:
        raise _NoRoom(f"the {board.name} has too few multipliers for textures; use ulx3s-85f")
    # Bands of fewer lines take more cycles, because every band reads all triangles.
    least = board.lines // 2 if board.compact else board.lines
    choices = [lines] if lines else sorted({board.lines, least}, reverse=True)
    largest = max((max(of.size) for of in scene.textures.values()), default=1)
    for level in range(max(largest.bit_length() - _LEAST_SIDE.bit_length(), 0) + 1):
        shown = one_level(scene, level)
        made = replace(design, albedo=fixed_albedo_of(shown, design.has_highlights))
        try:
            surface = Renderer(made).geometry.surface
            memory = MeshMemory.of([shown.mesh], surface, shown.textures)
        except ValueError as error:
            raise _NoRoom(str(error).partition("; ")[0]) from None
        screen = screen_bits(GRID, surface)
        for chosen in choices:
            free = _free_blocks(board, made, bits, chosen)
            if memory.blocks(screen) <= free:
                shrunk = f"{largest >> level} of {largest} texels a side fit the {board.name}"
                return shown, made, chosen, f"details of images ({shrunk})" if level else ""
    if most := MeshMemory.triangles_that_fit(free, screen, surface=surface):
        raise _NoRoom(f"with them the {board.name} has block RAMs for about {most:,} triangles")
    raise _NoRoom(f"the {board.name} has too few block RAMs for them; use ulx3s-85f")


def _free_blocks(board: Board, design: ShadingPipeline, bits: tuple[int, int, int], lines: int) -> int:
    """Block RAMs that bands, renderer, further tables and texels leave free for the mesh."""
    pixels = VGA.size[0] * lines
    style = "compact" if design.build.compact_geometry else "throughput"
    taken = block_rams(2 * pixels, sum(bits)) + block_rams(pixels, 27) + _RENDERER_BLOCKS[style]
    taken += 0 if design.transfer == "linear" else _TRANSFER_BLOCKS
    if (albedo := design.albedo) is not None:
        taken += _SURFACE_BLOCKS[style][albedo.colors, albedo.texture is not None]
        if albedo.texture is not None:
            memory = albedo.texture.memory
            taken += BANKS * block_rams(memory.depth, memory.WORD_BITS)
    return board.block_rams - taken


def _check_memory(
    board: Board, name: str, scene: Scene, design: ShadingPipeline, bits: tuple[int, int, int], lines: int
) -> None:
    """Refuse a mesh that does not fit into the block RAMs that are left for it."""
    if design.albedo is not None:
        return
    left, screen = _free_blocks(board, design, bits, lines), screen_bits()
    mesh, most = scene.mesh, MeshMemory.LARGEST - 1
    fits = len(mesh.faces) <= most and len(mesh.vertices) <= most
    if not fits or MeshMemory.of([mesh]).blocks(screen) > left:
        least = MeshMemory.triangles_that_fit(left, screen)
        raise InputError(
            f"--mesh {name}",
            f"its {len(mesh.faces):,} triangles do not fit the memory that the bands leave free on the "
            f"{board.name}",
            f"use a mesh of at most about {least:,} triangles",
        )


def least_cycles(drawing: Drawing) -> int:
    """Least cycles to draw a frame: cycles for its vertices, and for its triangles in every band."""
    return 3 * drawing.mesh.triangles * drawing.bands + drawing.transform.cycles * drawing.mesh.vertices


class BoardTop(Elaboratable):
    """The drawing, its display, the clocks and the pins of a board.

    Parameters
    ----------
    board : Board
        The board.
    gpu : Component
        A `GpuUnit`, or another component with ``pairs``, and with ``buttons`` if the top has buttons. It may
        have members of `loader_members`.
    plan : ClockPlan
        Clocks made from the board's clock.
    """

    def __init__(self, board: Board, gpu: Component, plan: ClockPlan):
        self.board, self.gpu, self.plan = board, gpu, plan

    def elaborate(self, platform):
        """Request the pins: clock, lanes of the connector ``hdmi``, buttons, pins of a loader."""
        m = Module()
        clock = platform.request(platform.default_clk, dir="-")
        m.submodules.clock = buffer = io.Buffer("i", clock)
        m.submodules.clocks = clocks = ClockUnit(self.plan)
        m.domains += [ClockDomain(name, reset_less=True) for name in clocks.clocks]
        m.d.comb += clocks.reference.eq(buffer.i)
        names = [pin.name for pin in platform.lookup("hdmi", 0).ios if hasattr(pin, "ios")]
        connector = platform.request("hdmi", 0, dir=dict.fromkeys(names, "-"))
        lanes = [*(connector.d[k] for k in range(LANES - 1)), connector.clk]
        m.submodules.cells = cells = OutputCells(LANES, lanes)
        m.submodules.gpu = gpu = self.gpu
        m.d.comb += cells.pairs.eq(gpu.pairs)
        buttons, pressed = [], gpu.buttons if hasattr(gpu, "buttons") else ()
        for k, (name, number) in enumerate(self.board.buttons[: len(pressed)]):
            port = platform.request(name, number, dir="-")
            m.submodules[f"button_{k}"] = button = io.Buffer("i", port)
            buttons.append(button.i)
        if buttons:
            m.d.comb += pressed.eq(Cat(buttons))
        connect_loader(m, platform, self.board, gpu)
        return m
