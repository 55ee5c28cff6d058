"""Every record, found in its file: in the order of the rooms, within a room by name.

A file without a record holds parts that records share. Components without a record: the frame constants, the
pixel assembler and the pixel merger, whose ports are not a stream ``i`` to a stream ``o``, and the
accumulator of the chord method. The records of the pipelines and of the chord interpolators, of which they
are parts, cover them. Beats of the pixel lanes depend on the cycles: they have tests of their own. So have
units with other ports: band depths, controls, the draw unit, and the units of the display that have two
clocks or never wait.
"""

import pkgutil
from importlib import import_module

from blysk.sim.units.record import Record

__all__ = ["RECORDS", "ROOMS"]

ROOMS = ("geometry", "normals", "cosines", "methods", "lighting", "video", "bus", "")
"""Rooms in the order in which data pass them; the last is for records outside a room."""

HELPERS = ("operands", "record", "registry", "triangles")
"""Modules beside the rooms that are no records."""


def _found() -> dict[str, Record]:
    records = {}
    for room in ROOMS:
        package = import_module(".".join(part for part in ("blysk.sim.units", room) if part))
        for module in pkgutil.iter_modules(package.__path__):
            if not module.ispkg and (room or module.name not in HELPERS):
                found = import_module(f"{package.__name__}.{module.name}")
                if record := getattr(found, "RECORD", None):
                    records[record.name] = record
    return records


RECORDS: dict[str, Record] = _found()
"""Records by the units' names."""
