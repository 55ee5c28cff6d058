"""The committed results of place and route, each with its date."""

import json
import re
from pathlib import Path
from typing import Any

__all__ = ["STORE", "design_of", "read_store"]

STORE = Path(__file__).with_name("placed.json")
"""The committed store: a list of entries of `blysk.bench.report.placed.merged`."""

_NAME = re.compile(
    r"pipeline ([\w-]+), ([\w-]+), 1 light(?:, (cosine|one_minus_cosine))?(?:, (\d pixel lanes))?"
)


def design_of(name: str) -> tuple[str, ...] | None:
    """Method, model, and if given operand and lanes, of a pipeline, from its name in ``blysk fpga``.

    ``None`` for several lights, another style, and names that do not belong to a pipeline.
    """
    found = _NAME.fullmatch(name)
    return tuple(word for word in found.groups() if word) if found else None


def read_store(path: Path = STORE) -> list[dict[str, Any]]:
    """Entries of the store."""
    entries: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    return entries
