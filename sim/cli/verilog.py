"""``blysk verilog``: the pipeline as Verilog."""

import os
from pathlib import Path

import click

from blysk.golden.pipeline import ShadingPipeline
from blysk.sim.api.design import built, design
from blysk.sim.api.options import BUILD, DESIGN, DOCUMENTS, NEEDS
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.cli.outputs import check_outputs
from blysk.sim.errors import InputError
from blysk.sim.output import all_or_none, write_text
from blysk.sim.run_files import check_beside
from blysk.sim.value_types import OutputFile

__all__ = ["command"]


def _check_testbench(made: ShadingPipeline) -> None:
    """Refuse cores that the test bench does not drive."""
    if made.albedo:
        raise InputError("--testbench", "its bench sends spans without colours", "leave out --albedo")
    build = made.build
    if build.pipes > 1 and not build.merged:
        raise InputError("--testbench", "its bench takes one stream of pixels", "also give --merged")
    if build.bus != "native":
        reason = f"its bench drives the native shader, not --bus {build.bus}"
        raise InputError("--testbench", reason, "leave one out")
    if build.takes_triangles:
        reason = f"its bench sends spans, and the core {build.top} takes triangles"
        remedy = "leave out --testbench, or the option that makes the core take triangles"
        raise InputError("--testbench", reason, remedy)


@click.command()
@options_of(DESIGN)
@options_of(NEEDS)
@options_of(BUILD)
@click.option("--name", default="blysk", show_default=True, help="Name of the top module.")
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    help="Verilog file.  [default: standard output; with --testbench no file]",
)
@click.option(
    "--testbench",
    metavar="DIR",
    type=click.Path(),
    help="New or empty folder for the Verilog and a cocotb test bench, which runs without blysk.",
)
@click.pass_context
def command(context, name, output, testbench, **_):
    """Emit the pipeline as Verilog-2001 for synthesis, with a table of its ports.

    The test bench compares the Verilog with the pixels of a small frame, in Icarus Verilog or Verilator. Run
    pip install cocotb, then python DIR/run.py. DIR/README.md explains the rest.

    \b
    Examples:
        blysk verilog --model cosquad_lin --lights 2 -o core.v
        blysk verilog --model phong --testbench bench
        blysk verilog --geometry hardware -o render.v
        blysk verilog --pipes 4 -o four.v
        blysk verilog --albedo colors,bilinear -o textured.v
        blysk verilog --top render --bus axi -o core.v
    """
    made = built(design(**given_options(context, [*DESIGN, *NEEDS])), given_options(context, BUILD))
    build = made.build
    if testbench is not None:
        _check_testbench(made)
    if output and build.bus != "native" and not output.endswith(".v"):
        raise InputError(
            f"-o {output}", "X.md, X.h and X.svd are written beside X.v", "use a name that ends in .v"
        )
    beside = [f"{output[:-2]}{suffix}" for suffix in DOCUMENTS] if output and build.bus != "native" else []
    check_outputs([], pictures=[], others=[output, *beside])
    check_beside(beside)
    # After the checks of options, because the hardware's description takes a second to import.
    from blysk.sim.api.bus_documents import documents_of
    from blysk.sim.api.verilog import header_of, verilog_and_unit
    from blysk.sim.cli.progress import steps
    from blysk.sim.frames.testbench import check_folder, write_testbench

    if testbench is not None:
        if output and Path(os.path.realpath(output)).is_relative_to(os.path.realpath(testbench)):
            raise InputError(output, "lies in the folder of --testbench", "choose another file")
        check_folder(testbench)
    # Hardware geometry takes over ten seconds.
    with steps(late=not build.takes_triangles) as show:
        show(f"writing the Verilog of a core with top {build.top}")
        text, unit = verilog_and_unit(made, name)
    with all_or_none():
        if output:
            write_text(output, text)
        if beside:
            for path, document in zip(beside, documents_of(unit, name).values(), strict=True):
                write_text(path, document)
    if testbench is not None:
        write_testbench(testbench, unit, name, text, header_of(unit))
    elif not output:
        click.echo(text, nl=False)
