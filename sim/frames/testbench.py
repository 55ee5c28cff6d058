"""A folder for users of the Verilog: a cocotb test bench, and the test vectors of a frame."""

import json
from collections.abc import Sequence
from importlib import resources
from string import Template
from typing import Any

from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.bus.bus import BusUnit
from blysk.sim.frames.vectors import Table, vectors

__all__ = ["bench_files"]

_TEMPLATES = ("run.py", "test_core.py")
_FOLDER = resources.files(__package__) / "templates"


def bench_files(
    design: ShadingPipeline, unit: Any, name: str, text: str, about: Sequence[str]
) -> dict[str, str]:
    """Files of a bench, its test vectors and the Verilog, by their paths in a folder.

    Parameters
    ----------
    design : ShadingPipeline
        The design. Its texels are inside.
    unit : Component
        The core, as `core_of` makes it.
    name, text : str
        Name of the top module, and Verilog of the core.
    about : sequence of str
        Lines of README.md that describe the core.
    """
    tables = vectors(design, unit)
    readme = Template((_FOLDER / "README.md").read_text(encoding="utf-8"))
    files = {f"{name}.v": text}
    files |= {name: (_FOLDER / name).read_text(encoding="utf-8") for name in _TEMPLATES}
    files |= {f"vectors/{table}.csv": _csv(found) for table, found in tables.items()}
    files["vectors/plan.json"] = json.dumps(_plan(unit, tables), indent=1) + "\n"
    rows = [f"| `{name}.csv` | {len(table)} {table.text} |" for name, table in tables.items()]
    files["README.md"] = readme.substitute(
        file=f"{name}.v", about="\n".join(f"- {line}" for line in about), tables="\n".join(rows)
    )
    return files


def _plan(unit: Any, tables: dict[str, Table]) -> dict[str, Any]:
    """What the bench does with each table."""
    core = unit.framing.core if isinstance(unit, BusUnit) else unit
    listed = {
        name: {
            "kind": table.kind,
            "phase": table.phase,
            "valid": table.valid,
            "ready": table.ready,
            "ports": list(table.columns),
        }
        for name, table in tables.items()
    }
    # On its own ports a core does not tell when its last hidden triangles have passed.
    settle = 4096 if "memory" in unit.signature.members and unit is core else 64
    return {"memories": _memories(core), "settle": settle, "tables": listed}


def _memories(core: Any) -> list[str]:
    """Beginnings of the ports of each memory of depths."""
    members = dict(core.signature.members)
    if "memory" not in members:
        return []
    member = members["memory"]
    return [f"memory_{bank}" for bank in range(*member.dimensions)] if member.dimensions else ["memory"]


def _csv(table: Table) -> str:
    rows = zip(*table.columns.values(), strict=True)
    return "\n".join(",".join(map(str, row)) for row in [tuple(table.columns), *rows]) + "\n"
