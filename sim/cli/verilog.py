"""``blysk verilog``: the pipeline as Verilog."""

import os
from collections.abc import Mapping
from pathlib import Path

import click

from blysk.golden.pipeline import ShadingPipeline
from blysk.sim.api.design import built, design
from blysk.sim.api.options import BUILD, DESIGN, DOCUMENTS, NEEDS
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.cli.outputs import check_outputs
from blysk.sim.errors import InputError
from blysk.sim.output import all_or_none, check_new_folder, write_folder, write_text
from blysk.sim.packages.registry import PACKAGES
from blysk.sim.run_files import check_beside
from blysk.sim.value_types import OutputFile

__all__ = ["command"]


def _check_bench(made: ShadingPipeline, option: str) -> None:
    """Refuse cores that the test bench of an option does not drive."""
    if made.texels_outside:
        raise InputError(option, "its bench has no memory of texels", "leave out outside")
    for name, least in (("x_bits", 6), ("y_bits", 6), ("length_bits", 7)):
        if (bits := getattr(made, name)) < least:
            thing = f"--{name.replace('_', '-')} {bits}"
            raise InputError(thing, f"the frame of {option} has 64x48 pixels", f"give at least {least}")


def _check_folders(output: str | None, folders: Mapping[str, str]) -> None:
    """Refuse folders that lie in each other, that have other files, or that hold the Verilog of ``-o``.

    ``folders`` has the option of each folder.
    """
    places = {option: Path(os.path.realpath(folder)) for option, folder in folders.items()}
    for option, place in places.items():
        if output and Path(os.path.realpath(output)).is_relative_to(place):
            raise InputError(output, f"lies in the folder of {option}", "choose another file")
        for other, its_place in places.items():
            if other != option and place.is_relative_to(its_place):
                raise InputError(option, f"its folder lies in the folder of {other}", "choose another folder")


@click.command()
@options_of(DESIGN)
@options_of(NEEDS)
@options_of(BUILD)
@click.option("--name", default="blysk", show_default=True, help="Name of the top module.")
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    help="Verilog file.  [default: standard output; with --testbench or --package no file]",
)
@click.option(
    "--testbench",
    metavar="DIR",
    type=click.Path(),
    help="New or empty folder for the Verilog and a cocotb test bench, which runs without blysk.",
)
@click.option(
    "--package",
    metavar="KIND DIR",
    type=(str, click.Path()),
    help="New or empty folder for a package of the core. "
    + " ".join(f"{name}: {package.text}." for name, package in PACKAGES.items()),
)
@click.pass_context
def command(context, name, output, testbench, package, **_):
    """Emit the pipeline as Verilog-2001 for synthesis, with a table of its ports.

    The test bench compares the Verilog with the output of a small frame, in Icarus Verilog or Verilator. Run
    pip install cocotb, then python DIR/run.py. DIR/README.md explains the rest.

    \b
    Examples:
        blysk verilog --model cosquad_lin --lights 2 -o core.v
        blysk verilog --model phong --testbench bench
        blysk verilog --geometry hardware -o render.v
        blysk verilog --pipes 4 -o four.v
        blysk verilog --albedo colors,bilinear -o textured.v
        blysk verilog --top render --bus axi -o core.v
        blysk verilog --top render --bus axi --package fusesoc core
    """
    made = built(design(**given_options(context, [*DESIGN, *NEEDS])), given_options(context, BUILD))
    build = made.build
    kind, folder = package or ("", None)
    if package and kind not in PACKAGES:
        raise InputError(f"--package {kind}", "unknown package", f"use one of {', '.join(PACKAGES)}")
    if package:
        PACKAGES[kind].check(made)
        if PACKAGES[kind].benched:
            _check_bench(made, f"--package {kind}")
    if testbench is not None:
        _check_bench(made, "--testbench")
    folders = {"--testbench": testbench, "--package": folder}
    folders = {option: path for option, path in folders.items() if path is not None}
    if output and build.bus != "native" and not output.endswith(".v"):
        raise InputError(
            f"-o {output}", "X.md, X.h and X.svd are written beside X.v", "use a name that ends in .v"
        )
    beside = [f"{output[:-2]}{suffix}" for suffix in DOCUMENTS] if output and build.bus != "native" else []
    check_outputs([], pictures=[], others=[output, *beside])
    check_beside(beside)
    _check_folders(output, folders)
    for path in folders.values():
        check_new_folder(path, "README.md")
    # After the checks of options, because the hardware's description takes a second to import.
    from blysk.sim.api.bus_documents import documents_of
    from blysk.sim.api.core_files import bench_of, package_files
    from blysk.sim.api.verilog import verilog_and_unit
    from blysk.sim.cli.progress import steps

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
            write_folder(testbench, bench_of(made, unit, name, text))
        if package:
            write_folder(folder, package_files(PACKAGES[kind], made, unit, name, text))
    if not (folders or output):
        click.echo(text, nl=False)
