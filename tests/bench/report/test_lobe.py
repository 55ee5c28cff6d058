"""The report's section of the lobe unit: its frames, its baselines, its costs."""

import numpy as np
import pytest

from blysk.bench.report import lobe
from blysk.bench.report.section import Table
from blysk.golden.presets import LOBES, MIRROR_LOBES, MODELS

SIZE = (64, 48)


@pytest.mark.parametrize("mesh", lobe.MESHES)
def test_meshes_have_unit_normals_that_are_those_of_their_faces(mesh):
    surface = lobe.mesh_of(mesh)
    normals = surface.normals
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-9)
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    kept = np.linalg.norm(faces, axis=1) > 1e-9
    along = (faces * normals[surface.faces].sum(axis=1)).sum(axis=1)[kept]
    assert (along > 0).all()


@pytest.mark.parametrize("mesh", ["sphere", "torus", "waves"])
def test_frames_are_exact(mesh):
    """Half an LSB is the rounding of a pixel; spans cost the rest."""
    for model, values in (("blinn", (1, 100)), ("ggx", (0.2, 0.7))):
        for method in ("quotient", "renormalise"):
            for row in lobe.frame_errors(mesh, method, model, values, SIZE):
                assert row["units"] <= 0.6
                assert row["total"] <= 0.5 + row["total_spans"] + 0.1
                # Those of the surface itself; of lines the codes count.
                assert row["total_spans"] < (1e-6 if method == "quotient" else 0.05)


def test_errors_of_a_model_that_is_not_exact_count_against_blinn():
    (row,) = lobe.frame_errors("sphere", "renormalise", "cosquad", (10,), SIZE)
    assert row["units"] <= 0.6
    assert row["total"] > 15
    assert row["total_spans"] < 1


def test_phong_counts_against_phong():
    """At no exponent is true Phong Blinn's highlight; the frames hold the one that they are asked for."""
    for row in lobe.frame_errors("sphere", "quotient", "phong", (1, 100), SIZE):
        assert row["total"] <= 0.6
        assert row["everywhere"] <= 0.6


@pytest.mark.long
def test_front_has_the_table_and_its_baselines():
    assert {model for _, model in lobe.FRONT} <= {*MODELS, *LOBES, *MIRROR_LOBES}
    assert lobe.unit_cost("lobe, memory outside")["memory_bits"] == 0


def test_section_is_whole():
    tasks = lobe.tasks(True)
    results = [
        {"errors_of_size": [[0.1] * len(case.values) for case in lobe.CASES]}.get(task.function.__name__)
        or (
            [dict.fromkeys(("value", "units", "total", "total_spans", "everywhere"), 0.5)]
            if task.function is lobe.frame_errors
            else dict.fromkeys(
                (
                    *("multipliers", "cells", "register_bits", "memory_bits", "latency"),
                    "initiation_interval",
                ),
                3,
            )
        )
        for task in tasks
    ]
    section = lobe.section(tasks, results)
    names = [part.name for part in section.parts]
    assert names == ["lobe-errors", "lobe-units", "lobe-frames"]
    frames = next(part for part in section.parts if isinstance(part, Table) and part.name == "lobe-frames")
    assert len(frames.rows) == sum(task.function is lobe.frame_errors for task in tasks)
