"""``blysk render``: a mesh or a scene file through the simulated pipeline."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, get_args

import click
from tqdm import tqdm

from blysk.golden.presets import METHOD_LINES, MODEL_LINES
from blysk.sim.api.options import DESIGN, RENDERING, SCENE
from blysk.sim.api.render import (
    BUILDING,
    SPECIALISING,
    Engine,
    RenderedFrame,
    Rendering,
    prepare_rendering,
    rendering_settings,
)
from blysk.sim.api.scene_file import key_lines
from blysk.sim.cli.options import given_options, lights_of, options_of
from blysk.sim.cli.outputs import animation_paths, check_outputs
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import Animation, dask_executor, process_executor, render_frames, write_gif
from blysk.sim.frames.figures import animation_figures
from blysk.sim.frames.picture import write_image
from blysk.sim.frames.summary import animation_lines, short_lines, specialisation_lines
from blysk.sim.frames.workers import check_address, processors
from blysk.sim.output import all_or_none, atomic_writer, write_json
from blysk.sim.run_files import check_beside
from blysk.sim.value_types import Choice, OutputFile, Whole

__all__ = ["command"]

MAX_FRAMES = 9999
"""Most frames of a turntable: four digits in their names."""

_SPECIALISE = (
    f"{'specialise':<12}builds the full pipeline and the smaller one and counts what each part takes: "
    "about half a minute the first time"
)


def _described(lines: dict[str, str]) -> str:
    width = max(map(len, lines)) + 2
    return "\n".join(f"    {name:<{width}}{text}" for name, text in lines.items())


_KEYS = "\n".join(f"    {line}" for line in key_lines())
_HELP = f"""Render MESH through the simulated pipeline.

MESH is a file (OBJ, PLY, STL, GLB, glTF), or `teapot`, or a scene file (TOML) that names one beside
camera, lights, material, size and method; options given here go before those of the file.

\b
Examples:
    blysk render teapot -o teapot.png
    blysk render model.obj --model cosquad_lin --exponent 200 --size 1280x720 --compare both.png
    blysk render scene.toml --exponent 100
    blysk render scene.toml --gate --specialise
    blysk render teapot --method chord-local --point-light 3,4,5 --viewer near
    blysk render teapot --method chord-local --spot-light 3,6,5,-3,-5,-5,8,14
    blysk render scene.toml --frames 36 -o turntable.gif

\b
Methods:
{_described(METHOD_LINES)}

\b
Models:
{_described(MODEL_LINES)}

\b
Keys of a scene file, all but mesh.file optional:
{_KEYS}
"""


@click.command(help=_HELP, short_help="Render a mesh or a scene file through the simulated pipeline.")
@click.argument("mesh")
@options_of(DESIGN)
@options_of(SCENE)
@click.option(
    "--engine",
    type=Choice("engine", get_args(Engine)),
    default="auto",
    show_default=True,
    help="auto: compiled or, without a C++ compiler, pysim at a smaller size.",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    help="Picture of the simulated frame.  [default: MESH's name, -blysk.png; none with --compare]",
)
@click.option("--compare", "comparison", type=OutputFile(), help="Picture: simulated, golden, error map.")
@click.option("--json", "figures", type=OutputFile(), help="Every printed figure.")
@options_of(RENDERING)
@click.option("--vcd", type=OutputFile(), help="Waveforms; --engine pysim, by default 160x120 pixels.")
@click.option(
    "--frames",
    type=Whole(1, MAX_FRAMES),
    help="Turntable: so many pictures, OUTPUT-0001.png and on, and OUTPUT.gif.",
)
@click.option("--jobs", type=Whole(1, 1024), help="Processes that draw the frames.  [default: processors]")
@click.option(
    "--cluster", "address", metavar="ADDRESS", help="Dask scheduler whose workers draw them: tcp://host:8786."
)
@click.option("-v", "--verbose", is_flag=True, help="Every figure, not the few that most need.")
@click.pass_context
def command(
    context, mesh, engine, output, comparison, figures, vcd, frames, jobs, address, verbose, **options
):
    """Render a mesh or a scene file; `_HELP` is the text that users see."""
    start = perf_counter()
    if not Path(mesh).stem:
        raise InputError(f"MESH {mesh!r}", "is no file's name", "give a mesh or scene file, or teapot")
    given = given_options(context, {**SCENE, **DESIGN, **RENDERING}.keys() - {"lights"})
    if lights := lights_of(options):
        given["lights"] = lights
    if vcd and engine == "cxxrtl":
        raise InputError("--vcd", "the engine cxxrtl writes no waveforms", "use --engine pysim")
    settings = rendering_settings(mesh, given, vcd)
    if not (output or comparison):
        output = f"{Path(mesh).stem}-blysk.{'gif' if frames else 'png'}"
    inputs = [mesh, str(settings.source)]
    if frames:
        pictures, gif = animation_paths(output, frames, {"--compare": comparison, "--vcd": vcd})
        if address is not None:
            check_address(address)
        if jobs and address:
            raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
        check_outputs(inputs, pictures=[gif, *pictures], others=[figures])
        check_beside(path for path in (gif, *pictures) if path != output)
        written = {"frames": f"{pictures[0]} to {pictures[-1]}", "animation": gif}
    elif jobs or address is not None:
        raise InputError("--jobs" if jobs else "--cluster", "is for many frames", "give --frames, too")
    else:
        check_outputs(inputs, pictures=[output, comparison], others=[figures, vcd])
        written = {"frame": output, "comparison": comparison}
    # The frames of an animation are written as they are done.
    drawn: list[str] = []
    together = _removed_on_failure(drawn) if frames else all_or_none()
    with together, tqdm(bar_format="{desc}", leave=False, disable=None) as stage:
        ready = prepare_rendering(
            settings,
            engine="pysim" if vcd else engine,
            frames=frames or 0,
            remote=bool(address),
            stage=partial(_told, stage),
        )
        stage.set_description_str("rasterising and simulating")
        if frames:
            report = _animation(ready, pictures, jobs, address, drawn)
            stage.set_description_str("writing the animation")
            write_gif(gif, pictures)
            drawn.append(gif)
            report["seconds"]["animation"] = perf_counter() - start - sum(report["seconds"].values())
        else:
            frame = _frame(ready, vcd)
            stage.set_description_str("comparing with the golden renderer")
            report = frame.figures
            stage.set_description_str("writing")
            if output:
                frame.save(output)
            if comparison:
                frame.save_comparison(comparison)
        report["seconds"]["total"] = perf_counter() - start
        if figures:
            write_json(figures, report)
    if frames:
        lines = animation_lines(report)
    elif verbose:
        lines = frame.lines()
    else:
        lines = short_lines(report)
        if "specialisation" in report:
            lines = [*lines, *specialisation_lines(report["specialisation"])]
    for line in lines:
        print(line)
    for name, path in {**written, "figures": figures, "waves": vcd}.items():
        if path:
            print(f"{name:<12}{path}")


@contextmanager
def _removed_on_failure(files: Sequence[str]) -> Iterator[None]:
    """Remove files if another output of the block cannot be written; an interrupt leaves them."""
    try:
        yield
    except InputError:
        for path in files:
            Path(path).unlink(missing_ok=True)
        raise


def _told(bar: tqdm, text: str) -> None:
    """Show a stage of the work; for a stage that may take long, print its time, also without a terminal."""
    bar.set_description_str(text)
    if text == SPECIALISING:
        print(_SPECIALISE, flush=True)
    elif text.startswith(BUILDING) and text != BUILDING:
        print(f"{'building':<12}{text.removeprefix('building ')}", flush=True)


def _frame(ready: Rendering, vcd: str | None) -> RenderedFrame:
    """Render the frame, with a progress bar."""
    with (
        atomic_writer(vcd) if vcd else nullcontext() as waves,
        tqdm(unit=" pixels", unit_scale=True, delay=1, leave=False, disable=None) as bar,
    ):

        def show(done: int, count: int) -> None:
            bar.total = count
            bar.update(done - bar.n)

        return ready.render(show, vcd=waves and str(waves))


def _animation(
    ready: Rendering, pictures: Sequence[str], jobs: int | None, address: str | None, drawn: list[str]
) -> dict[str, Any]:
    """Render and write the frames of a turntable, append their names to ``drawn``; figures of all."""
    start = perf_counter()
    smallest = ready.specialisation
    animation = Animation(
        smallest.scenes[0],
        smallest.design,
        ready.engine,
        ready.design,
        ready.pipes,
        ready.setups,
        ready.coarse,
    )
    cameras = [scene.camera for scene in ready.scenes]
    if address:
        workers = dask_executor(animation, address)
    else:
        workers = process_executor(animation, min(jobs or processors(), len(cameras)))
    done = {}
    mesh = {"mesh": ready.loaded.name}
    with workers as executor, tqdm(total=len(cameras), unit=" frames", leave=False, disable=None) as bar:
        for index, frame in render_frames(executor, cameras):
            write_image(pictures[index], frame.image)
            drawn.append(pictures[index])
            counts = {**ready.counts, **frame.figures["counts"]}
            done[index] = {"picture": pictures[index], **mesh, **frame.figures, "counts": counts}
            bar.update()
        name = executor.name
    figures = animation_figures([done[index] for index in range(len(cameras))])
    figures["counts"] |= ready.counts
    return {
        **mesh,
        **figures,
        "ignored": list(ready.loaded.ignored),
        "workers": name,
        "seconds": {**ready.seconds, "frames": perf_counter() - start},
    }
