"""The work of ``blysk render``, after its options are checked."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from blysk.sim.api.render import BUILDING, SPECIALISING, Rendering, prepare_rendering
from blysk.sim.api.rendered_frame import RenderedFrame
from blysk.sim.api.settings import Settings
from blysk.sim.cli.progress import progress, steps
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import Animation, dask_executor, process_executor, render_frames, write_gif
from blysk.sim.frames.figures import animation_figures
from blysk.sim.frames.picture import write_image
from blysk.sim.frames.summary import animation_lines, short_lines, specialisation_lines
from blysk.sim.frames.workers import processors
from blysk.sim.output import all_or_none, atomic_writer, write_json

__all__ = ["draw_frame", "draw_turntable"]

_SPECIALISE = (
    f"{'specialise':<12}builds the full and the smaller pipeline, and counts the parts of each: "
    "about half a minute the first time"
)


def draw_frame(
    settings: Settings,
    engine: str,
    output: str | None,
    comparison: str | None,
    figures: str | None,
    vcd: str | None,
    verbose: bool,
    start: float,
) -> Iterable[str]:
    """Draw a frame, and write all its files or none.

    Parameters
    ----------
    settings : Settings
        Result of `rendering_settings`.
    engine : str
        As for `prepare_rendering`.
    output, comparison, figures, vcd : str or None
        Files to be written: picture, comparison, JSON, waveforms.
    verbose : bool
        Whether every figure is printed.
    start : float
        `perf_counter` at the start of the command.

    Returns
    -------
    iterable of str
        The lines to be printed.
    """
    with all_or_none(), steps(late=True) as stage:
        engine = "pysim" if vcd else engine
        ready = prepare_rendering(settings, engine=engine, stage=partial(_show_stage, stage))
        stage("rasterising and simulating")
        frame = _frame(ready, vcd)
        stage("comparing with the golden renderer")
        report = frame.figures
        stage("writing")
        if output:
            frame.save(output)
        if comparison:
            frame.save_comparison(comparison)
        report["seconds"]["total"] = perf_counter() - start
        if figures:
            write_json(figures, report)
    if verbose:
        return frame.lines()
    saved = report.get("specialisation")
    return [*short_lines(report), *(specialisation_lines(saved) if saved else ())]


def draw_turntable(
    settings: Settings,
    engine: str,
    pictures: Sequence[str],
    gif: str,
    figures: str | None,
    jobs: int | None,
    address: str | None,
    start: float,
) -> Iterable[str]:
    """Draw the frames of a turntable. Each frame is written when it is done, and stays after an interrupt.

    Parameters
    ----------
    settings, engine, figures, start
        As for `draw_frame`.
    pictures : sequence of str
        File of each frame.
    gif : str
        File of the animation.
    jobs : int or None
        Number of processes; by default the number of processors.
    address : str or None
        Address of a Dask scheduler. Its workers replace the processes.

    Returns
    -------
    iterable of str
        The lines to be printed.
    """
    drawn: list[str] = []
    with _removed_on_failure(drawn), steps(late=True) as stage:
        ready = prepare_rendering(
            settings,
            engine=engine,
            frames=len(pictures),
            remote=bool(address),
            stage=partial(_show_stage, stage),
        )
        stage("rasterising and simulating")
        report = _animation(ready, pictures, jobs, address, drawn)
        stage("writing the animation")
        write_gif(gif, pictures)
        drawn.append(gif)
        report["seconds"]["animation"] = perf_counter() - start - sum(report["seconds"].values())
        report["seconds"]["total"] = perf_counter() - start
        if figures:
            write_json(figures, report)
    return animation_lines(report)


@contextmanager
def _removed_on_failure(files: Sequence[str]) -> Iterator[None]:
    """Remove the files if another output of the block cannot be written. An interrupt leaves them."""
    try:
        yield
    except InputError:
        for path in files:
            Path(path).unlink(missing_ok=True)
        raise


def _show_stage(show: Callable[[str], None], text: str) -> None:
    """Show a stage of the work. For a long stage also print a line, which says how long the stage takes."""
    show(text)
    if text == SPECIALISING:
        print(_SPECIALISE, flush=True)
    elif text.startswith(BUILDING) and text != BUILDING:
        print(f"{'building':<12}{text.removeprefix('building ')}", flush=True)


def _frame(ready: Rendering, vcd: str | None) -> RenderedFrame:
    """Render the frame, with a progress bar."""
    with (
        atomic_writer(vcd) if vcd else nullcontext() as waves,
        progress(total=None, unit="pixels", scaled=True) as bar,
    ):

        def show(done: int, count: int) -> None:
            bar.total = count
            bar.update(done - bar.n)

        return ready.render(show, vcd=waves and str(waves))


def _animation(
    ready: Rendering, pictures: Sequence[str], jobs: int | None, address: str | None, drawn: list[str]
) -> dict[str, Any]:
    """Render and write the frames of a turntable, and append their names to ``drawn``. Return the figures."""
    start = perf_counter()
    smallest = ready.specialisation
    animation = Animation(smallest.scenes[0], smallest.design, ready.engine, ready.design)
    cameras = [scene.camera for scene in ready.scenes]
    if address:
        workers = dask_executor(animation, address)
    else:
        workers = process_executor(animation, min(jobs or processors(), len(cameras)))
    done = {}
    mesh = {"mesh": ready.loaded.name}
    with workers as executor, progress(total=len(cameras), unit="frames") as bar:
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
