"""``blysk board``: a mesh on a monitor, as a bitstream for a board, or simulated down to the lanes.

Both use the same top module, `GpuUnit`. It draws the turning mesh from block RAM in bands, and sends the
bands to a monitor at 640x480 and 60 Hz. For a bitstream the top gets the board's pins and a PLL. Tools that
pip installs map, place and route the top. The reached clock rates are compared with the needed rates, and the
bitstream is read back. In a simulation, models replace the output cells. The bits of the four lanes are
decoded as in a monitor, and the frames are compared with the frames of the bit-accurate model.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from time import perf_counter
from typing import Any

import click
import numpy as np

from blysk.bench.tools.board_build import BoardNetlist, Built, build
from blysk.bench.tools.board_design import BoardTop, gpu_of, least_cycles
from blysk.bench.tools.board_from import Rewritten, RoutedBitstream, changed_lines, rewrite
from blysk.bench.tools.board_loader import loader_of
from blysk.bench.tools.boards import Board
from blysk.bench.tools.tool_runner import ToolError
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.bus.loader import BAUD
from blysk.golden.frames.border import BORDER
from blysk.golden.frames.compare import compare_image
from blysk.golden.gpu import Gpu
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import SPACES
from blysk.golden.video.clock_plan import ClockPlan, NoClockPlan, clock_plan
from blysk.golden.video.draw_unit import turned
from blysk.hdl.core.scene_memory import contents_from
from blysk.hdl.emit.processes import run_program
from blysk.hdl.gpu import GpuUnit
from blysk.sim.cli.progress import progress, steps
from blysk.sim.engines.toggles import ToggleCounter
from blysk.sim.errors import InputError, SimulationError
from blysk.sim.frames.display import OneClock, Shown, show
from blysk.sim.frames.error_names import reference_of
from blysk.sim.frames.picture import check_image_path, write_image
from blysk.sim.output import atomic_writer
from blysk.sim.run_files import check_beside

__all__ = [
    "bitstream_of",
    "built_lines",
    "design_lines",
    "figures_of",
    "load_bitstream",
    "missed",
    "planned",
    "rewritten_from",
    "shown_lines",
    "simulated",
    "toggled",
    "too_heavy",
    "write_bitstream",
    "write_rewritten",
]


def planned(
    board: Board,
    mesh: str,
    given: Mapping[str, Any],
    colours: str,
    clock: float | None = None,
    source: RoutedBitstream | None = None,
    loader: str | None = None,
    made_for: str | None = None,
) -> tuple[Gpu, list[Scene], ClockPlan]:
    """The drawing of a mesh on a board, the scenes of its presets, and its clocks.

    Parameters
    ----------
    board, mesh, given, colours
        As in `gpu_of`.
    clock : float, optional
        Rate of the drawing clock, MHz. By default that of the board.
    source : RoutedBitstream, optional
        Bitstream of the same design, whose memories the drawing must fit. By default memories have room for
        as many words as their block RAMs hold.
    loader : str, optional
        Source of a loader's bytes, one of `LOADERS`. By default there is no loader.
    made_for : str, optional
        With a loader: mesh of the bitstream, whose memories the drawing must fit. By default ``mesh``.

    Raises
    ------
    InputError
        As in `gpu_of` and `loader_of`. If no PLL gives the clocks, or a frame takes longer than the display
        leaves. If the drawing does not fit the memories, or the bitstream is of another design.
    """
    lines, first, clock = None, None, clock or board.clock
    if source is not None:
        lines = min(source.lines, board.lines)
    if made_for is not None:
        first = gpu_of(board, made_for, given, colours)[0]
        lines = first.buffer.lines
    gpu, scenes = gpu_of(board, mesh, given, colours, lines)
    try:
        plan = clock_plan(board.reference, gpu.buffer.mode.pixel_rate, 1e6 * clock)
    except NoClockPlan as error:
        raise InputError(f"--clock {clock:g}", str(error), "give another rate") from error
    _check_load(gpu, plan)
    first = first or gpu
    room = first.drawing.room
    if source is not None:
        loaded = gpu if loader is None else loader_of(gpu, plan, loader, mesh, gpu, room)
        source.check_facts(facts_of(board, loaded, plan))
        source.check_room(mesh, gpu.drawing)
        room = source.room
    if loader is not None:
        return loader_of(gpu, plan, loader, mesh, first, room), scenes, plan
    return replace(gpu, drawing=gpu.drawing.padded(room)), scenes, plan


def bitstream_of(board: Board, gpu: Gpu, plan: ClockPlan, seeds: int) -> Built:
    """The bitstream of a drawing, made by `build`. The steps are shown."""
    rates = {name: float(rate) / 1e6 for name, rate in plan.rates.items()}
    carried = carried_of(board, gpu, plan)
    with steps(repeat=False) as show_step:
        top = BoardTop(board, GpuUnit(gpu), plan)
        return build(board, top, rates, seeds, show_step, carried)


def rewritten_from(source: RoutedBitstream, board: Board, gpu: Gpu, plan: ClockPlan) -> Rewritten:
    """The bitstream of a drawing, made from a routed bitstream of the same design. The steps are shown."""
    with steps() as show_step:
        show_step("netlist")
        netlist = _same_netlist(source, board, gpu, plan)
        return rewrite(source, netlist.patterns.contents, show_step)


def _same_netlist(source: RoutedBitstream, board: Board, gpu: Gpu, plan: ClockPlan) -> BoardNetlist:
    """Netlist of a drawing. It is refused if it differs from that of the bitstream."""
    netlist = BoardNetlist.of(board, BoardTop(board, GpuUnit(gpu), plan))
    source.check_netlist(netlist)
    return netlist


def carried_of(board: Board, gpu: Gpu, plan: ClockPlan) -> dict[str, Any]:
    """Facts for the comment in a bitstream; see `RoutedBitstream`."""
    return {"facts": facts_of(board, gpu, plan), "room": gpu.drawing.room, "lines": gpu.buffer.lines}


def facts_of(board: Board, gpu: Gpu, plan: ClockPlan) -> dict[str, str]:
    """Facts about a design that are no words of its memories, by name."""
    lines = design_lines(board, "", gpu, plan)
    facts = {line[:12].strip(): line[12:] for line in lines if not line.startswith("mesh")}
    design, background = gpu.drawing.renderer.design, gpu.buffer.background
    facts["materials"] = str(design.materials)
    facts["background"] = "#" + bytes(background).hex()
    facts["back faces"] = gpu.drawing.frames[0].back_faces
    return facts


def write_bitstream(built: Built, path: str) -> None:
    """Write a bitstream.

    Raises
    ------
    ToolError
        If a clock is not met. Nothing is written.
    """
    if missed(built):
        raise ToolError(missed(built))
    _write(path, built.bitstream)


def write_rewritten(rewritten: Rewritten, path: str) -> None:
    """Print what has changed in a bitstream, and write it."""
    click.echo("\n".join(changed_lines(rewritten)))
    _write(path, rewritten.bitstream)


def _write(path: str, bitstream: bytes) -> None:
    with atomic_writer(path) as temporary:
        temporary.write_bytes(bitstream)
    click.echo(f"{'bitstream':<12}{path}, {len(bitstream):,} bytes, read back and equal")


def figures_of(built: Built) -> dict[str, Any]:
    """Figures of a bitstream for the JSON file."""
    clocks = {clock.name: asdict(clock) for clock in built.clocks}
    return {"seed": built.seed, "bytes": len(built.bitstream), "parts": built.parts, "clocks": clocks}


def design_lines(board: Board, mesh: str, gpu: Gpu, plan: ClockPlan) -> Iterator[str]:
    """Lines about the design: board, mesh, shading, display, clocks."""
    drawing, buffer = gpu.drawing, gpu.buffer
    yield f"{'board':<12}{board.name}"
    yield (
        f"{'mesh':<12}{mesh}, {drawing.mesh.triangles:,} triangles, {drawing.mesh.vertices:,} vertices, "
        f"{len(drawing.presets)} presets"
    )
    design = drawing.renderer.design
    style = "compact" if design.build.compact_geometry else "fast"
    lights = "1 light" if design.lights == 1 else f"{design.lights} lights"
    codes = f"codes of {SPACES[design.transfer]}"
    yield f"{'shading':<12}{design.method}, {design.model}, {lights}, {style} geometry, {codes}"
    if design.albedo is not None:
        yield f"{'surface':<12}{_surface(design.albedo)}"
    bits = "".join(map(str, buffer.colour_bits))
    yield f"{'display':<12}640x480 at 60 Hz, bands of {buffer.lines} lines, RGB{bits}"
    rates = ", ".join(f"{name} {float(rate) / 1e6:.6g} MHz" for name, rate in plan.rates.items())
    yield f"{'clocks':<12}{rates}"
    if (loader := gpu.loader) is not None:
        sources = [f"serial line at {BAUD / 1e6:g} Mbaud"] if loader.uart else []
        sources += [f"flash at {loader.flash.offset:#x}"] if loader.flash else []
        yield f"{'loader':<12}{', '.join(sources)}"


def _surface(albedo: Albedo) -> str:
    """Text about vertex colours and textures."""
    parts = ["vertex colours"] if albedo.colors else []
    if (texture := albedo.texture) is not None and texture.memory.fixed is not None:
        loaded = texture.memory.fixed
        sizes = {(1 << of.width, 1 << of.height) for of in loaded.descriptors}
        width, height = max(sizes, key=lambda size: size[0] * size[1])
        parts.append(f"texture of {width}x{height} texels" + (", or smaller" if len(sizes) > 1 else ""))
    return f"{' and '.join(parts)}" + (", without levels of detail" if albedo.texture else "")


def _frame_cycles(gpu: Gpu, plan: ClockPlan) -> float:
    """Cycles of the drawing clock in a frame of the display."""
    return float(plan.rates["sync"] / plan.rates["pixel"]) * gpu.buffer.mode.cycles


def _check_load(gpu: Gpu, plan: ClockPlan) -> None:
    """Refuse a mesh whose triangles and vertices alone take longer than a frame of the display."""
    least, most = least_cycles(gpu.drawing), _frame_cycles(gpu, plan)
    if least > most:
        raise InputError(
            "--mesh",
            f"a frame of {gpu.drawing.mesh.triangles:,} triangles takes {least:,} cycles or more, and 60 Hz "
            f"leaves {most:,.0f}: too heavy by a factor of {least / most:.2f}",
            "use fewer triangles, or a faster --clock",
        )


def simulated(
    board: Board,
    gpu: Gpu,
    scenes: Sequence[Scene],
    plan: ClockPlan,
    count: int,
    folder: Path,
    source: RoutedBitstream | None = None,
) -> dict[str, Any]:
    """Simulate frames, write them, and compare them with the frames of the model and the exact frame.

    The memories have the words that are read back from a bitstream, if one is given.

    Returns figures of the frames.
    """
    words: AbstractContextManager[None] = nullcontext()
    if source is not None:
        _same_netlist(source, board, gpu, plan)
        read = source.contents
        words = contents_from(lambda name, width, words: read[name])
    paths = [folder / f"frame-{number:04}.png" for number in range(1, count + 1)]
    made = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"cannot be made ({error.strerror})", "give another folder") from error
    try:
        for path in paths:
            check_image_path(path)
        check_beside(paths)
        start = perf_counter()
        rate = Fraction(plan.rates["sync"] / plan.rates["serial"])
        mode = gpu.buffer.mode
        line = mode.horizontal.total
        with words, progress(total=count * mode.vertical.total, unit="lines") as bar:
            top = OneClock(GpuUnit(gpu), rate)
            shown = show(top, mode, count, progress=lambda pixels: bar.update(pixels // line - bar.n))
        seconds = perf_counter() - start
        for path, frame in zip(paths, shown.frames, strict=True):
            write_image(path, frame)
    except BaseException:
        if made and not any(folder.iterdir()):
            folder.rmdir()
        raise
    expected = gpu.frames(count)
    click.echo("\n".join(shown_lines(gpu, scenes[0], plan, shown, expected)))
    click.echo(f"{'written':<12}{paths[0]}" + (f" to {paths[-1].name}" if count > 1 else ""))
    click.echo(f"{'seconds':<12}{seconds:.1f} to build and simulate")
    heavy = too_heavy(gpu, plan, shown)
    if heavy:
        raise SimulationError(heavy)
    differing = [
        k + 1 for k, pair in enumerate(zip(shown.frames, expected, strict=True)) if (pair[0] != pair[1]).any()
    ]
    if differing:
        raise SimulationError(f"frame {differing[0]} differs from the bit-accurate model's")
    return {
        "frames": count,
        "clock": float(plan.rates["sync"]) / 1e6,
        "cycles": round(_busy(gpu, shown)),
        "late_bands": shown.status["late_bands"],
    }


def toggled(board: Board, gpu: Gpu, plan: ClockPlan, count: int) -> dict[str, int]:
    """Register bits that toggle in a frame, of the drawing and of the display. They are also printed."""
    rate = Fraction(plan.rates["sync"] / plan.rates["serial"])
    top = ToggleCounter(OneClock(GpuUnit(gpu), rate))
    counts = show(top, gpu.buffer.mode, count).status
    found = {
        part: round(
            sum(bits for path, bits in counts.items() if path.startswith(f"inner.top.{name}")) / count
        )
        for part, name in (("drawing", "draw"), ("display", "display"))
    }
    click.echo(_toggles_line(found))
    return found


def _toggles_line(counted: Mapping[str, int]) -> str:
    parts = ", ".join(f"{part} {bits / 1e6:.1f}" for part, bits in counted.items())
    return f"{'toggles':<12}{sum(counted.values()) / 1e6:.1f} million register bits a frame: {parts}"


def _busy(gpu: Gpu, shown: Shown) -> float:
    """Mean cycles in which the drawing is busy with a frame, from all begun bands.

    Cycles without a request do not count.
    """
    return shown.status["busy"] / max(shown.status["bands"], 1) * gpu.drawing.bands


def shown_lines(gpu: Gpu, scene: Scene, plan: ClockPlan, shown: Shown, expected: np.ndarray) -> Iterator[str]:
    """Lines about a simulation: frames, cycles, errors.

    Parameters
    ----------
    gpu, scene, plan
        Drawing, first scene and clocks of the simulation.
    shown : Shown
        Result of the simulation.
    expected : uint8 array, shape (n, height, width, 3)
        Frames of the bit-accurate model.
    """
    count = len(shown.frames)
    equal = sum((found == wanted).all() for found, wanted in zip(shown.frames, expected, strict=True))
    yield f"{'lanes':<12}{count} frames decoded; words, sync, balance right; {equal} equal the model's"
    busy, most = _busy(gpu, shown), _frame_cycles(gpu, plan)
    yield (
        f"{'cycles':<12}{busy:,.0f} a frame of {most:,.0f} at 60 Hz; without the display "
        f"{float(plan.rates['sync']) / busy:.0f} frames a second"
    )
    yield f"{'late bands':<12}{shown.status['late_bands']}"
    controls = gpu.drawing.controls
    exact = turned(scene, controls.advance(controls.start).angle)
    figures = compare_image(exact, gpu.drawing.renderer.design, shown.frames[0])
    for kind, error in (("method", figures.method_error), ("total", figures.total_error)):
        yield (
            f"{'error':<12}{kind:<7} largest {error.max_lsb:.2f} LSB of {SPACES[figures.transfer]}, "
            f"{error.p999_lsb:.2f} at 99.9 %, {error.psnr_db:.1f} dB, against "
            f"{reference_of(kind, figures.target)}"
        )
    at_border = f"{figures.border_pixels:,} pixels have {figures.border} at most {BORDER:g}"
    yield f"{'':<12}errors are of the first frame, {figures.visible_pixels:,} pixels; {at_border}"


def too_heavy(gpu: Gpu, plan: ClockPlan, shown: Shown) -> str:
    """A line that says by how much frames are too heavy for the display. Empty if no frame is too heavy."""
    late = shown.status["late_bands"]
    if not late:
        return ""
    factor = _busy(gpu, shown) / _frame_cycles(gpu, plan)
    slot = f"a band takes longer than its slot {late} times" if factor <= 1 else ""
    by = f"a frame takes {factor:.2f} times the cycles that 60 Hz leaves" if factor > 1 else slot
    return f"too heavy for 60 Hz: {by}; {late} bands of {len(shown.frames)} frames show the background"


def built_lines(built: Built) -> Iterator[str]:
    """Lines about a bitstream: used and available parts, reached and needed clock rates."""
    for name, (used, available) in built.parts.items():
        yield f"{name:<16}{used:>7,} of {available:,}"
    for clock in built.clocks:
        verdict = "met" if clock.met else "MISSED"
        rates = f"{clock.reached:7.1f} MHz of {clock.needed:.1f} needed"
        yield f"{clock.name:<16}{rates}, {verdict}; {clock.path}"
    if built.closed:
        yield (
            f"{built.closed} multipliers have registers on both sides. Paths between these registers are "
            "not timed."
        )


def missed(built: Built) -> str:
    """A line about the clock that is missed by the largest factor. Empty if all clocks are met."""
    clock = min(built.clocks, key=lambda clock: clock.reached / clock.needed)
    if clock.met:
        return ""
    return (
        f"clock {clock.name} is not met: {clock.reached:.1f} MHz of {clock.needed:.1f} needed, by "
        f"{clock.path}; give {'a lower --clock, or ' if clock.name == 'sync' else ''}more --seeds"
    )


def load_bitstream(loader: str, board: Board, path: str) -> None:
    """Load a bitstream into the FPGA's memory."""
    done = run_program([loader, "-b", board.loader, path], capture_output=True, text=True, errors="replace")
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise ToolError(f"openFPGALoader ends with status {done.returncode}: {lines[-1]}")
    click.echo(f"{'loaded':<12}{board.name}")
