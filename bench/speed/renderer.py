"""Time and memory of the golden renderer, and time of VTK's software renderer on the same scene.

``python -m blysk.bench.speed.renderer`` draws a teapot of 100,000 triangles at 1920x1080 with both, in one
run. The exit status is 1 if the golden renderer takes 3 s or 2 GiB or more. The command needs the ``bench``
extra (VTK).
"""

import sys
from collections.abc import Sequence

import click

from blysk.bench.command import run
from blysk.sim.cli.progress import steps
from blysk.sim.frames.workers import local_executor
from blysk.sim.installation import install_extra
from blysk.sim.value_types import Size, Whole

__all__ = ["LARGEST_MEMORY", "LONGEST_SECONDS", "main"]

LONGEST_SECONDS = 3.0
"""Target: a frame takes less than this number of seconds on one core."""

LARGEST_MEMORY = 2 * 2**30
"""Target: the rendering process takes less than this number of bytes of memory."""


@click.command()
@click.option(
    "--triangles",
    type=Whole(50, 1_000_000),
    default=100_000,
    show_default=True,
    help="Approximate triangles of the teapot.",
)
@click.option("--size", type=Size(), default="1920x1080", show_default=True, help="Size of the picture.")
@click.option(
    "--repeats", type=Whole(1, 100), default=3, show_default=True, help="Runs. The fastest run counts."
)
def _command(triangles, size, repeats) -> int:
    """Draw a teapot with the golden renderer and with VTK, and compare times and memory with the targets."""
    import numpy as np

    from blysk.bench.speed.renderer_times import golden_times, scene_for, timed, vtk_image
    from blysk.golden.reference.raster import rasterise

    width, height = size
    scene = scene_for(triangles, width, height)
    raster = rasterise(scene)
    print(
        f"teapot, {len(scene.mesh.faces):,} triangles, {width}x{height}, Phong shading: "
        f"{raster.visible.sum():,} visible pixels, {len(raster.x):,} spans "
        f"and {raster.hidden_spans:,} hidden spans"
    )
    del raster
    with local_executor(1) as pool, steps() as step:
        step("draw with the golden renderer")
        golden, frame, memory = pool.submit(golden_times, triangles, width, height, repeats).result()
    for model, timing in golden.items():
        print(f"golden, {model:5}: {timing.wall:.3f} s, {timing.cpu:.3f} s of processor time")
    print(f"golden: {memory / 2**20:.0f} MiB, largest memory of its process, with mesh and imports")

    try:
        draw, name = vtk_image(scene)
    except ModuleNotFoundError as error:
        print(f"{error.name} is not installed; to compare with VTK, run {install_extra('bench')}")
        return 1
    with steps() as step:
        step("draw with VTK")
        peer, drawn = timed(draw, repeats)
    print(f"VTK ({name}): {peer.wall:.3f} s, {peer.cpu:.3f} s of processor time, mesh already loaded")
    print(f"ratio golden / VTK, R·V in both: {golden['phong'].one_core / peer.one_core:.2f}")
    difference = np.abs(frame.image * 255 - drawn)
    surface = frame.mask | (drawn != 255 * np.array(scene.background)).any(axis=-1)
    share = (difference[surface].max(axis=-1) > 2).mean()
    print(
        f"difference on the surface: mean {difference[surface].mean():.3f} of 255, "
        f"{share:.3%} of its pixels differ by more than 2"
    )
    missed = False
    for model, timing in golden.items():
        if timing.one_core >= LONGEST_SECONDS:
            print(f"missed: {model} took {timing.one_core:.2f} s, the target is {LONGEST_SECONDS:g} s")
            missed = True
    if memory >= LARGEST_MEMORY:
        print(f"missed: {memory / 2**30:.2f} GiB, the target is {LARGEST_MEMORY / 2**30:g} GiB")
        missed = True
    return int(missed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and compare with the targets.

    Returns
    -------
    int
        0, or 1 if the golden renderer missed a target or VTK is missing, or 2 for bad input.
    """
    return run(_command, "blysk.bench.speed.renderer", arguments)


if __name__ == "__main__":
    sys.exit(main())
