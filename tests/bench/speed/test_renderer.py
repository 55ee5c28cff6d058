import re
from types import SimpleNamespace

import numpy as np
import pytest

from blysk.bench.speed import renderer, renderer_times
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.sim.installation import install_extra

SMALL = ["--triangles", "100", "--size", "16x12", "--repeats", "1"]


def test_vtk_draws_the_same_picture():
    """VTK is another implementation of the whole golden renderer."""
    pytest.importorskip("vtkmodules", reason="VTK is not installed")
    scene = renderer_times.scene_for(2000, 160, 120)
    draw, name = renderer_times.vtk_image(scene)
    drawn = draw()
    assert name
    frame = render(scene, "phong", REFLECTION_MODELS["phong"])
    assert frame.mask.mean() > 0.2
    # Rounding to 8 bits is 0.25 in the mean. Pixels on silhouettes may differ.
    difference = np.abs(frame.image * 255 - drawn)[frame.mask]
    assert difference.mean() < 0.5
    assert (difference > 2).mean() < 0.01


@pytest.mark.long
def test_report_and_exit_status(monkeypatch, capsys):
    monkeypatch.setattr(
        renderer_times, "vtk_image", lambda scene: (lambda: np.zeros((12, 16, 3), np.uint8), "nothing")
    )
    # Memory that this process already has does not count.
    held = np.ones(2**28, dtype=np.uint8)
    assert renderer.main(SMALL) == 0
    del held
    report = capsys.readouterr().out
    for part in (
        "16x12",
        "golden, blinn",
        "golden, phong",
        "MiB",
        "VTK (nothing)",
        "ratio golden / VTK",
        "mean",
    ):
        assert part in report
    (memory,) = re.findall(r"golden: (\d+) MiB", report)
    assert 30 < int(memory) < 256
    monkeypatch.setattr(renderer, "LONGEST_SECONDS", 0.0)
    assert renderer.main(SMALL) == 1
    assert "missed: phong took" in capsys.readouterr().out
    monkeypatch.setattr(renderer, "LONGEST_SECONDS", 3.0)
    monkeypatch.setattr(renderer, "LARGEST_MEMORY", 1)
    assert renderer.main(SMALL) == 1
    assert "GiB, the target is" in capsys.readouterr().out


def test_without_vtk(monkeypatch, capsys):
    def missing(scene):
        raise ModuleNotFoundError("No module named 'vtkmodules'", name="vtkmodules")

    monkeypatch.setattr(renderer_times, "vtk_image", missing)
    assert renderer.main(SMALL) == 1
    assert (
        f"vtkmodules is not installed; to compare with VTK, run {install_extra('bench')}"
        in capsys.readouterr().out
    )


def test_fastest_run_counts(monkeypatch):
    # Runs of 5, 3 and 4 s by the clock, with 1, 2 and 7 s of processor time.
    wall, processor = iter([0, 5, 5, 8, 8, 12]), iter([0, 1, 1, 3, 3, 10])
    clock = SimpleNamespace(perf_counter=lambda: next(wall), process_time=lambda: next(processor))
    monkeypatch.setattr(renderer_times, "time", clock)
    timing, result = renderer_times.timed(lambda: "result", 3)
    assert result == "result"
    assert timing == renderer_times.Timing(wall=3, cpu=2)
    assert renderer_times.Timing(wall=4, cpu=7).one_core == 7
