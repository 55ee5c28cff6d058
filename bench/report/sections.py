"""Sections of the report: their names and files. A section's file is imported when it is asked for."""

from importlib import import_module
from types import ModuleType

__all__ = ["SECTIONS", "load"]

SECTIONS: dict[str, str] = {
    "points": "blysk.bench.report.points",
    "methods": "blysk.bench.report.methods",
    "stability": "blysk.bench.report.stability",
    "needs": "blysk.bench.report.needs",
    "criteria": "blysk.bench.report.criteria",
    "rivals": "blysk.bench.report.rivals",
    "words": "blysk.bench.report.words",
    "world": "blysk.bench.report.world",
    "place-and-route": "blysk.bench.report.place_and_route",
    "geometry": "blysk.bench.report.geometry",
    "albedo": "blysk.bench.report.albedo",
    "energy": "blysk.bench.report.energy",
    "thesis": "blysk.bench.report.thesis",
    "cosine-quadratic": "blysk.bench.report.cosine_quadratic",
    "phong-blinn": "blysk.bench.report.phong_blinn",
    "errata": "blysk.bench.report.errata",
}
"""Files of the sections by name, in the order of the page."""


def load(name: str) -> ModuleType:
    """The module of a section of `SECTIONS`, with its functions ``tasks`` and ``section``."""
    return import_module(SECTIONS[name])
