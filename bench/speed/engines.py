"""Speed of the engines and of Verilator, on the same pipeline and beats, in one run.

``python -m blysk.bench.speed.engines`` measures both engines and Verilator's model of the emitted Verilog.
Each shades the longer spans of a teapot at 4000x3000 by the quotient pipeline of one light. The command
prints the pixels a second of each. The exit status is 1 if the compiled engine

- makes less than 5 million pixels a second on one core,
- is less than 200 times as fast as pysim, or
- is slower than Verilator.

Seconds are processor time of this process, which has one thread. So other work on the machine does not count.
A run of an engine is the whole call, with packing and unpacking of beats. A run of Verilator is only the loop
over the cycles, from packed beats to packed beats.
"""

import sys
from collections.abc import Sequence

import click

from blysk.bench.command import run
from blysk.sim.cli.progress import steps
from blysk.sim.value_types import Size, Whole

__all__ = ["TARGETS", "main"]

TARGETS = {"": 5e6, "verilator": 1, "pysim": 200}
"""Targets of ``cxxrtl``. Key ``""`` has the least pixels a second.

The key of another engine has the least ratio of the speed of ``cxxrtl`` to the speed of this engine.
"""


@click.command()
@click.option(
    "--size",
    type=Size(),
    default="4000x3000",
    show_default=True,
    help="Size of the picture whose spans the engines shade.",
)
@click.option(
    "--repeats", type=Whole(1, 100), default=5, show_default=True, help="Runs. The fastest run counts."
)
def _command(size, repeats) -> int:
    """Measure the pixels a second of every engine, and compare them with the targets."""
    from blysk.bench.speed.engine_rates import beats_of_teapot, measure
    from blysk.golden.presets import preset
    from blysk.hdl.pipeline import ShadingPipelineUnit

    with steps() as step:
        step("make the spans")
        unit = ShadingPipelineUnit(preset("quotient", "blinn"))
        beats, write = beats_of_teapot(unit, *size)
        rates = measure(unit, beats, write, repeats, step=step)
    print(f"{'engine':<14}{'pixels/s':>14}{'cxxrtl is faster':>20}")
    for name, rate in rates.items():
        print(f"{name:<14}{rate:>14,.0f}{rates['cxxrtl'] / rate:>19,.2f}x")
    missed = [
        f"{least:,.0f} times {name}" if name else f"{least:,.0f} pixels a second"
        for name, least in TARGETS.items()
        if rates["cxxrtl"] < least * rates.get(name, 1)
    ]
    print(f"missed: {', '.join(missed)}" if missed else "every target met")
    return 1 if missed else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and compare with the targets.

    Returns
    -------
    int
        0, or 1 if the compiled engine missed a target, or 2 for bad input.
    """
    return run(_command, "blysk.bench.speed.engines", arguments)


if __name__ == "__main__":
    sys.exit(main())
