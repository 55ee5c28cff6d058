# amaranth: UnusedElaboratable=no
"""Parts that sample scenes do not need: the scenes, the figures, and the section."""

from pathlib import Path

import numpy as np
import pytest

from blysk.bench.report import needs
from blysk.bench.report.needs import QUICK_SCENES, SCENES, measure, section, simulate_both, tasks
from blysk.bench.ring import ring
from blysk.golden.frames.frame import model_frame
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.faces import face_normals
from blysk.hdl.emit.cost import Cost
from blysk.sim.api.scene_file import read_scene_file
from blysk.sim.frames.frame import SimulatedFrame
from blysk.sim.frames.specialise import Specialisation
from blysk.sim.meshes.mesh import load_mesh

EXAMPLES = Path(__file__).parents[3] / "examples"
SMALL = [100, 75, 1000]

WHY = {
    "copper teapot": "1 of 1 tables, fixed at build time",
    "matt teapot, k_s = 0": "no specular path: every k_s is 0",
    "teapot in ambient light": "no light path",
    "grey teapot": "one channel of three",
    "three materials alike": "no memory of materials: 1 of 3 are distinct",
    "one of two lights is off": "1 of 2 lights",
    "floor lit from behind, exponent 500": "the gate proves that no span holds a highlight",
    "steel ring, two lights": "exponent fixed at 120",
    "teapot beside a lamp": "exponent fixed at 80",
}


@pytest.fixture
def costs(monkeypatch):
    """Costs without a netlist: each reduction has a cell less."""

    def counted(specialisation):
        full, *steps = (
            Cost(cells, {(18, 18): cells // 10}, 0, 10 * cells, 5, cells)
            for cells in range(100, 99 - len(specialisation.reductions), -1)
        )
        return full, tuple(steps)

    monkeypatch.setattr(Specialisation, "costs", counted)


@pytest.mark.parametrize("name", SCENES)
def test_scenes(name, costs):
    """Each scene shows its purpose, and its frame equals the full pipeline's."""
    found = measure(name, SMALL)
    assert any(WHY[name] in reason for reason in found["reasons"])
    assert found["different_pixels"] == 0
    assert found["pixels"] > 300
    assert [saves["cells"] for saves in found["alone"]] == [1] * len(found["reasons"])
    assert found["full"]["cells"] - found["specialised"]["cells"] == 1
    assert not {"cycles", "full_cycles"} & set(found)


def test_a_frame_that_differs_is_told(monkeypatch, costs):
    compute = ShadingPipeline.compute

    def brighter(self, spans, constants):
        pixels = compute(self, spans, constants)
        if self.specular.fixed is not None:
            pixels.color[:, 0] ^= 1
        return pixels

    monkeypatch.setattr(ShadingPipeline, "compute", brighter)
    found = measure("copper teapot", SMALL)
    assert found["different_pixels"] > 300
    assert found["largest_difference"] == 1


@pytest.mark.long
def test_a_matt_scene_saves_a_quarter():
    """By its netlists, and by simulation of both. Half of the multipliers are saved."""
    found = measure("matt teapot, k_s = 0", SMALL)
    shares = {"cells": 0.7, "multipliers": 0.5, "register_bits": 0.76, "memory_bits": 0.6}
    for resource, share in shares.items():
        assert 0 < found["specialised"][resource] < share * found["full"][resource]
    simulated = simulate_both("matt teapot, k_s = 0", SMALL)
    assert simulated["different_pixels"] == 0
    assert found["pixels"] < simulated["cycles"] <= simulated["full_cycles"]


def test_both_are_simulated(monkeypatch):
    """Two simulators draw; the specialised one has the scene for which it was made."""
    asked = []

    class Simulator:
        def __init__(self, design, engine):
            self.design = design

        def render(self, scene):
            asked.append((self.design, len(scene.lights)))
            frame = SimulatedFrame(**vars(model_frame(scene, self.design)), cycles=0, engine="pysim")
            frame.image[0, : len(asked) - 1] ^= 1
            return frame

    monkeypatch.setattr(needs, "FrameSimulator", Simulator)
    found = simulate_both("one of two lights is off", SMALL)
    assert found == {"cycles": 0, "full_cycles": 0, "different_pixels": 1}
    assert [(design.lights, lights) for design, lights in asked] == [(2, 2), (1, 1)]


def test_ring_is_that_of_the_examples():
    mesh, example = ring(), load_mesh(str(EXAMPLES / "ring.obj")).mesh
    assert len(mesh.faces) == len(example.faces) == 2 * 36 * 18
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    corners = mesh.normals[mesh.faces]
    assert (np.einsum("fk,fnk->fn", face_normals(mesh), corners) > 0.9).all()
    for vertex in mesh.vertices[::50]:
        assert np.abs(example.vertices - vertex).max(axis=1).min() < 1e-4


@pytest.mark.parametrize(
    ("file", "name"), [("ring", "steel ring, two lights"), ("lamp", "teapot beside a lamp")]
)
def test_scenes_of_the_examples(file, name):
    values = read_scene_file(str(EXAMPLES / f"{file}.toml")).values
    build, options = SCENES[name]
    scene = build(*values["size"], 1000)
    assert scene.material.exponent == values["exponent"]
    assert scene.camera.position == tuple(values["position"])
    assert len(scene.lights) == len(values["lights"])
    assert (options["method"], options["model"]) == (values["method"], values["model"])


def test_section():
    figures = {"cells": 100, "multipliers": 10, "register_bits": 1000, "memory_bits": 0}
    half = {name: count // 2 for name, count in figures.items()}
    counted = {
        "full": figures,
        "specialised": half,
        "largest_difference": 0,
        "different_pixels": 0,
        "reasons": ["this"],
        "alone": [half],
        "method": "quadratic",
        "model": "cosquad",
        "pixels": 7,
    }
    names = QUICK_SCENES[:2]
    full = [task for task in tasks(quick=False) if task.settings["name"] in names]
    simulated = {"cycles": 9, "full_cycles": 12, "different_pixels": 0}
    results = [counted, counted | {"specialised": figures}, simulated, simulated | {"different_pixels": 3}]
    assert [task.function for task in full] == [measure, measure, simulate_both, simulate_both]
    made = section(full, results)
    assert made.name == "needs"
    totals, alone = made.parts
    assert [row["cells, share of the full"] for row in alone.records()] == [0.5] * len(alone.rows)
    assert "50% of the cells" in made.conclusion.sentence
    first, second = totals.records()
    assert (first["cells, full"], first["cells, specialised"], first["cycles, specialised"]) == (100, 50, 9)
    assert (first["pixels of another colour"], second["pixels of another colour"]) == (0, 3)
    assert [row[-1] for row in totals.grades] == ["good", "bad"]
    assert [row["saves cells"] for row in alone.records()] == [50, 50]

    quick = tasks(quick=True)
    assert [task.settings["name"] for task in quick] == list(QUICK_SCENES)
    several = counted | {"reasons": ["this", "that"], "alone": [half, half]}
    totals, alone = section(quick[:2], [several, several]).parts
    assert totals.records()[0]["cycles, full"] is None
    assert [row["omission and reason"] for row in alone.records()] == ["this", "that"] * 2
