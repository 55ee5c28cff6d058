"""``blysk explore``: the design space; see `blysk.bench.report.explore`."""

import math
from collections.abc import Sequence

import click

from blysk.bench.tools.defaults import EXPONENT, SIZE
from blysk.bench.tools.sweep import COSTS, DEGREES, OPERANDS, SERVED, WORDS, Sweep
from blysk.golden.build import LANES, STYLES
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.presets import METHODS, PUBLISHED
from blysk.sim.errors import InputError
from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.workers import check_address
from blysk.sim.meshes.mesh_path import check_mesh_file
from blysk.sim.output import check_writable
from blysk.sim.value_types import Choice, OutputFile, Size, Whole

__all__ = ["command"]


class _Some(click.ParamType):
    """Type of an option: names or whole numbers with commas between them."""

    def __init__(self, values: Sequence[str | int]):
        self.values = tuple(values)
        self.name = "LIST"

    def get_metavar(self, param, ctx):
        return self.name

    def convert(self, value, param, ctx):
        """The values without repetitions. `InputError` if a value is unknown."""
        if isinstance(value, tuple):
            return value
        known = {str(one): one for one in self.values}
        unknown = [word for word in value.split(",") if word not in known]
        if unknown:
            reason = f"{unknown[0]!r} is not one of the choices"
            raise InputError(f"{param.opts[0]} {value}", reason, f"choose from {','.join(known)}")
        return tuple(dict.fromkeys(known[word] for word in value.split(",")))


class _Error(click.ParamType):
    """Type of an option: limit of the largest error, in LSB."""

    name = "LSB"

    def convert(self, value, param, ctx):
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not 0 < number <= 255:
            raise InputError(
                f"{param.opts[0]} {value}",
                "not an error limit",
                "give a number above 0 and up to 255, in LSB",
            )
        return number


def _option(name: str, values: Sequence[str | int], default: Sequence[str | int], text: str):
    listed = ",".join(map(str, default))
    return click.option(name, type=_Some(values), default=listed, show_default=True, help=text)


_USUAL = Sweep()


@click.command()
@click.option("--mesh", default="teapot", show_default=True, help="Mesh file, or teapot.")
@click.option(
    "--exponent",
    type=Whole(1, MAX_EXPONENT),
    default=EXPONENT,
    show_default=True,
    help="Exponent of the highlight.",
)
@click.option(
    "--size", type=Size(), default="x".join(map(str, SIZE)), show_default=True, help="Size of the picture."
)
@click.option(
    "--largest-error",
    "largest",
    type=_Error(),
    default=1.0,
    show_default=True,
    help="Limit of the largest error of any channel.",
)
@click.option(
    "--error",
    type=Choice("error", ERRORS),
    default="method",
    show_default=True,
    help="Reference of the error. arithmetic: the same method and model in float64. method: exact normals of "
    "every pixel, same model. total: exact normals with Blinn's power; lobes with their own model.",
)
@click.option(
    "--cost", type=Choice("cost", COSTS), default="cells", show_default=True, help="Cost that is to be low."
)
@_option(
    "--methods",
    [*METHODS, *PUBLISHED],
    _USUAL.methods,
    f"Methods of interpolation along a span; also {', '.join(PUBLISHED)}.",
)
@_option("--models", SERVED, _USUAL.models, f"Reflection models: {', '.join(SERVED)}.")
@_option("--lights", range(1, MAX_LIGHTS + 1), _USUAL.lights, f"Numbers of lights, up to {MAX_LIGHTS}.")
@_option("--operands", OPERANDS, OPERANDS, "Operands of the specular unit.")
@_option(
    "--degrees",
    DEGREES,
    _USUAL.degrees,
    "Degrees of the polynomial: 2 and 3 for the forms of quadratic, 1 and 2 for bisection.",
)
@_option(
    "--fraction-bits",
    WORDS,
    _USUAL.fraction_bits,
    "Fraction bits of the differences of chord-local: even numbers from 36 to 46.",
)
@_option("--styles", STYLES, _USUAL.styles, "One pixel a cycle, or few multipliers.")
@_option("--lanes", LANES, _USUAL.lanes, "Numbers of lanes of quotient in the throughput style.")
@click.option(
    "--limit", type=Whole(1, 1000), default=10, show_default=True, help="Number of designs to list."
)
@click.option("--jobs", type=Whole(1, 1024), help="Processes.  [default: number of cores]")
@click.option(
    "--cluster", "address", metavar="ADDRESS", help="Dask scheduler whose workers measure: tcp://host:8786."
)
@click.option("--json", "figures", type=OutputFile(), help="JSON file with every figure of every design.")
def command(mesh, exponent, size, largest, error, cost, limit, jobs, address, figures, **choices):
    """Draw a scene with every design of a sweep, and list the cheapest designs under an error.

    Choices are lists with commas between the values. The sweep has every combination of the choices. If a
    method does not have a choice, the choice is not varied for this method. Errors are in LSB of an 8-bit
    channel of linear light. Cells, multipliers, register bits and memory bits are counted in the netlist,
    before technology mapping. Cycles are an upper bound of the cycles a pixel. The bound follows from the
    figures of the units and the spans of the scene. bisection has no bound for spans that it divides. Designs
    with a * are on the Pareto front
    of the sweep: no design is better in both error and cost. Several lights stand evenly around the scene.
    The cache keeps earlier results.

    \b
    Example:
        blysk explore --methods quotient,renormalise --models blinn --largest-error 0.6 --cost multipliers
    """
    if jobs and address is not None:
        raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
    if address is not None:
        check_address(address)
    if figures:
        check_writable(figures)
    sweep = Sweep(**choices)
    candidates, impossible = sweep.candidates()
    left_out = "; ".join(f"{count} of {reason}" for reason, count in impossible.items())
    if not candidates:
        raise InputError("the sweep", f"holds no possible design, {left_out}", "choose other combinations")
    check_mesh_file(mesh)
    from blysk.bench.report.explore import explore

    explore(candidates, mesh, exponent, size, error, largest, cost, limit, jobs, address, figures, impossible)
