"""The table of docs/guide/accuracy.md, from the report.json of a full report.

``python -m blysk.bench.report.accuracy_table report/report.json`` prints it.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from blysk.bench.command import run
from blysk.sim.errors import InputError

__all__ = ["accuracy_table", "main"]


def accuracy_table(points: Sequence[Mapping[str, Any]]) -> str:
    """The table of docs/guide/accuracy.md, as Markdown: the designs of `DESIGNS`.

    The table has the largest arithmetic and method error in LSB at each exponent. At exponent 100 it has the
    largest total error, cycles a pixel and millions of simulated pixels a second.

    Parameters
    ----------
    points : sequence of dict
        Points of `section`. Every design must be simulated, and exponent 100 must be among the exponents.
    """
    from blysk.bench import accuracy

    points = [p for p in points if p["group"] != "software" and "operand" not in p["settings"]]
    exponents = sorted({point["settings"]["exponent"] for point in points})
    lines = [
        "| mesh | method | model | "
        + " | ".join(f"n = {exponent}" for exponent in exponents)
        + " | total | cycles a pixel | Mpixel/s simulated |",
        f"|---|---|---|{'---:|' * (len(exponents) + 3)}",
    ]
    rows = {
        (point["settings"]["source"], point["settings"]["method"], point["settings"]["model"]): {}
        for point in points
    }
    for point in points:
        settings = point["settings"]
        rows[settings["source"], settings["method"], settings["model"]][settings["exponent"]] = point
    for (source, method, model), row in rows.items():
        if (method, model) not in accuracy.DESIGNS:
            continue
        errors = [row[exponent]["errors"] for exponent in exponents]
        times = row[100]["times"]
        cells = [Path(source).stem, method, model]
        cells += [f"{error['arithmetic_max_lsb']:.2f} / {error['method_max_lsb']:.2f}" for error in errors]
        cells += [f"{row[100]['errors']['total_max_lsb']:.1f}", f"{times['cycles_per_pixel']:.3f}"]
        cells += [f"{times['simulated_pixels_per_second'] / 1e6:.1f}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


@click.command()
@click.argument("report", type=click.Path())
def _command(report):
    """Print the table of docs/guide/accuracy.md from the report.json of a full report."""
    try:
        sections = json.loads(Path(report).read_text(encoding="utf-8"))["sections"]
        click.echo(accuracy_table(sections["points"]["figures"]["points"]), nl=False)
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(report, "is not a full report", "give the report.json of `blysk bench`") from None


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table.

    Returns
    -------
    int
        0, or 2 for bad input.
    """
    return run(_command, "blysk.bench.report.accuracy_table", arguments)


if __name__ == "__main__":
    sys.exit(main())
