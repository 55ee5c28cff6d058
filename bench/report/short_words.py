"""Errors of exact normals in short words, a table of the report's section on word lengths."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from blysk.bench.report.rivals import FULL, QUICK, rastered
from blysk.bench.report.section import Cell, Table
from blysk.bench.store import Task
from blysk.golden.frames.border import border_mask
from blysk.golden.reference.reflection import BLINN
from blysk.golden.reference.renderer import render
from blysk.golden.rivals.short_words import SHORT_WORDS, short_light

__all__ = ["EXPONENTS", "measure_short", "table_of", "tasks"]

EXPONENTS = (10, 100, 1000)


def measure_short(words: str, mesh: str, size: Sequence[int]) -> dict[str, Any]:
    """Largest errors of `short_light` in LSB off the border of the light, before a pixel is rounded.

    Parameters
    ----------
    words : str
        A name of `SHORT_WORDS`.
    mesh, size
        As in `rivals.errors`.

    Returns
    -------
    dict
        ``triangles`` of the mesh, and ``errors``: a number for each of `EXPONENTS`.
    """
    scene, raster = rastered(mesh, tuple(size))
    errors = []
    for exponent in EXPONENTS:
        lit = replace(scene, material=replace(scene.material, exponent=exponent))
        exact = 255 * render(lit, "phong", BLINN, raster).image.reshape(-1, 3)
        border = border_mask(lit, raster, BLINN).reshape(-1)
        which = np.flatnonzero(raster.visible & ~border[raster.pixel])
        error = np.abs(short_light(lit, raster, words)[which] - exact[raster.pixel[which]])
        errors.append(float(error.max()))
    return {"triangles": len(scene.mesh.faces), "errors": errors}


def tasks(quick: bool) -> list[Task]:
    """A measurement for each kind of words and each mesh of the rivals."""
    size, meshes = QUICK if quick else FULL
    return [
        Task(measure_short, {"words": words, "mesh": mesh, "size": list(size)})
        for words in SHORT_WORDS
        for mesh in meshes
    ]


def table_of(tasks: Sequence[Task], results: Sequence[dict[str, Any]]) -> Table:
    """The table of the results of `tasks`."""
    rows: list[list[Cell]] = [
        [
            task.settings["words"],
            "teapot" if task.settings["mesh"].startswith("teapot") else "torus",
            found["triangles"],
            *found["errors"],
        ]
        for task, found in zip(tasks, results, strict=True)
    ]
    columns = ["words", "mesh", "triangles", *(f"largest error at n = {n}, LSB" for n in EXPONENTS)]
    note = (
        "Exact unit normals for every pixel, then N·L, N·H and its power in short words. Against exact Blinn "
        "shading, off the border of the light, before a pixel is rounded. The material is that of the rivals."
    )
    return Table("words-short", "Exact normals in short words", columns, rows, note)
