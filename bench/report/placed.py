"""Committed results of place and route: parts and clock rates of pipelines, each with its date.

A quick report reads these results, because placement takes minutes. ``blysk fpga --json FILE`` measures
further designs. With ``--device`` there are parts, and no clock rates.
``python -m blysk.bench.report.placed FILE [FILE ...]`` merges the files into the store.
"""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import Any

import click

from blysk.bench.command import run
from blysk.sim.api.placed import STORE, design_of, read_store
from blysk.sim.errors import InputError
from blysk.sim.output import write_json

__all__ = ["merged", "placed"]

_PARTS = ("luts", "flip_flops", "multipliers", "block_rams", "distributed_rams")
_MAPPED = ("carries", "others")
"""Further parts of designs that are mapped to a device without placement."""


def merged(
    entries: Iterable[Mapping[str, Any]], measured: Mapping[str, Any], date: str, command: str
) -> list[dict[str, Any]]:
    """Entries with the figures of ``blysk fpga --json``, which replace older figures of the same designs.

    Parameters
    ----------
    entries : iterable of dict
        Entries so far.
    measured : dict
        Figures of ``blysk fpga --json``.
    date : str
        Date of the measurement, such as 2026-11-23.
    command : str
        Command of the measurement.

    Returns
    -------
    list of dict
        Entries in the order of device and name: ``design``, ``device``, the parts, ``fmax_mhz`` of each seed
        (none without placement), ``tools``, ``date`` and ``command``.
    """
    found = {(entry["device"], entry["design"]): dict(entry) for entry in entries}
    for design in measured["designs"]:
        # Designs that are only mapped may have several devices.
        device = design["device"] if "device" in design else measured["device"]
        found[device, design["design"]] = {
            "design": design["design"],
            "device": device,
            **{part: design[part] for part in (*_PARTS, *(part for part in _MAPPED if part in design))},
            "fmax_mhz": [seed["fmax"] for seed in design["seeds"]],
            "tools": measured["tools"],
            "date": date,
            "command": command,
        }
    return [found[key] for key in sorted(found)]


def placed(device: str, path: Path = STORE) -> dict[tuple[str, ...], dict[str, Any]]:
    """Committed figures of pipelines with one light on a device, by `design_of`.

    ``fmax_median_mhz`` is added.
    """
    found = {}
    for entry in read_store(path):
        design = design_of(entry["design"])
        if design and entry["device"] == device:
            found[design] = entry | {"fmax_median_mhz": median(entry["fmax_mhz"])}
    return found


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path())
@click.option("--date", default=lambda: datetime.now(UTC).date().isoformat(), show_default="today")
@click.option("--command", "by", default="blysk fpga", show_default=True, help="Command that made the files.")
@click.option(
    "--store",
    type=click.Path(path_type=Path),
    default=STORE,
    help="Store to use in place of the committed store.",
)
def _merge(files: Sequence[str], date: str, by: str, store: Path) -> int:
    """Merge files of `blysk fpga --json` into the store of place and route."""
    entries = read_store(store) if store.exists() else []
    for file in files:
        try:
            entries = merged(entries, json.loads(Path(file).read_text(encoding="utf-8")), date, by)
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(
                file, "has no figures of place and route", "write the file with blysk fpga --json"
            ) from None
    write_json(store, entries)
    click.echo(f"{'placed':<12}{len(entries)} designs in {store}")
    return 0


if __name__ == "__main__":
    sys.exit(run(_merge, "blysk.bench.report.placed", None))
