"""Names of the units that have a record. The records are not imported, because an import takes a second.

The name of a unit is the name of its record's file. A file without a record holds parts that records share.
"""

import pkgutil
import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from blysk.golden.methods.installed import installed_methods

__all__ = ["ROOMS", "UNITS"]

ROOMS = ("geometry", "normals", "cosines", "methods", "albedo", "lighting", "video", "bus", "")
"""Rooms in the order in which data pass through them. The last name is for records outside a room."""

_RECORD = re.compile(r"^RECORD = ", re.MULTILINE)


def _found() -> dict[str, str]:
    units = {}
    for room in ROOMS:
        package = import_module(".".join(part for part in ("blysk.bench.units", room) if part))
        (folder,) = package.__path__
        for module in pkgutil.iter_modules(package.__path__):
            path = Path(folder, f"{module.name}.py")
            if not module.ispkg and _RECORD.search(path.read_text(encoding="utf-8")):
                units[module.name] = f"{package.__name__}.{module.name}"
    for entry in installed_methods():
        spec = find_spec(entry.module)
        if spec and spec.origin and _RECORD.search(Path(spec.origin).read_text(encoding="utf-8")):
            units[entry.module.rpartition(".")[2]] = entry.module
    return units


UNITS: dict[str, str] = _found()
"""The module of each record by the unit's name.

The units are in the order of `ROOMS`, and by name within a room. `installed_methods` follow.
"""
