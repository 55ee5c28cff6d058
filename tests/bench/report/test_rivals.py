# amaranth: UnusedElaboratable=no
"""The section on rivals: its fronts, the work of hosts, and counts against netlists."""

import pytest

from blysk.bench.report.rivals import LIGHTS, errors, host_work, parts, section, tasks
from blysk.bench.report.rivals_fronts import front_of, placed_of, placed_table
from blysk.bench.report.section import Drawing, Table
from blysk.bench.tools.families import DEVICE
from blysk.golden.reference.raster import rasterise
from blysk.golden.rivals.registry import COMPARED
from blysk.sim.api.placed import read_store

from ...golden.rivals.scenes import small_scene


def test_a_front_has_the_points_that_no_other_beats():
    points = {"a": (1, 9), "b": (2, 3), "c": (3, 3), "d": (9, 1), "e": (9, 2), "same": (2, 3)}
    assert front_of(points) == ["a", "b", "same", "d"]
    assert front_of({"a": (1, 2, 9), "b": (1, 3, 8), "c": (1, 3, 9), "d": (2, 2, 2)}) == ["a", "b", "d"]


def test_work_of_hosts_by_hand():
    """Operations that can be counted by hand: six powers a light, a root for each normal."""
    found = {}
    for lights in (1, 2):
        scene = small_scene(lights=lights)
        raster = rasterise(scene)
        for name in ("abbas", "duff", "chord-local", "renormalise, 3"):
            found[name, lights] = host_work(COMPARED[name], scene, raster)
    for lights in (1, 2):
        assert found["abbas", lights]["triangle"]["functions"] == 6 * lights
        assert found["abbas", lights]["triangle"]["roots"] == 3
        assert "roots" not in found["duff", lights]["triangle"]
        assert found["chord-local", lights]["span"]["roots"] == 3
        assert found["renormalise, 3", lights]["span"] == found["renormalise, 3", 1]["span"]
    # Gradients by 4 products of a reciprocal and 3 sums of two; three planes of 6 products.
    triangle = found["renormalise, 3", 1]["triangle"]
    assert triangle["divisions"] == 1
    assert triangle["multiplications"] == 2 + 4 + 4 + 9 + 18


def _fake(task):
    name = task.settings["name"]
    if task.function is errors:
        place = list(COMPARED).index(name)
        return [
            {
                "exponent": exponent,
                "triangles": 992,
                "shown": 700,
                "pixels": 5000,
                "max_lsb": 0.02 * (place + 1),
                "pixel_lsb": 0.5 + 0.02 * place,
                "share": place / 100,
                "cycles": 1 + place / 10,
                "switched": 1000.0 - 10 * place,
            }
            for exponent in task.settings["exponents"]
        ]
    return {
        "multipliers": 10,
        "adder_bits": 500,
        "memory_bits": 0,
        "register_bits": 900,
        "products": {"pixel": 7, "span": 6, "triangle": 0},
        "netlist": None,
        "bits": 112,
        "beat": "span",
        "host": {"triangle": {"multiplications": 3.0}, "span": {}},
    }


@pytest.mark.long
def test_section_of_made_up_results():
    chosen = tasks(quick=True)
    found = section(chosen, [_fake(task) for task in chosen])
    assert [part.name for part in found.parts if isinstance(part, Table)] == [
        f"rivals-{name}" for name in ("parts", "host", "errors", "placed")
    ]
    table = found.parts[0]
    assert len(table.rows) == len(COMPARED) * len(LIGHTS)
    drawings = [part for part in found.parts if isinstance(part, Drawing)]
    names = "area", "lights", "energy", "energy-lights", "placed"
    assert [of.name for of in drawings] == [f"rivals-{name}" for name in names]
    for of in drawings[1], drawings[3]:
        assert all(f"{lights} light" in of.svg for lights in LIGHTS)
    # The first method has the least error and time here; the others switch fewer bits.
    assert "teapot, 992 triangles: `quotient`" in found.text[2]
    assert "`loisel`" not in found.text[4]


def test_times_of_placed_methods():
    """By hand: a cycle and a half at the median rate, times the look-up tables of the store."""
    frame = {"exponent": 100, "triangles": 992, "cycles": 1.5, "max_lsb": 0.02}
    names = "quotient", "quotient, phong", "duff", "chord-local", "renormalise, 3"
    found = placed_table({"teapot-1000": {name: [frame] for name in names}})
    rows = {row[0]: dict(zip(found.columns, row, strict=True)) for row in found.rows}
    assert "duff" not in rows
    assert "`duff`, `bishop-weimer`, `bishop-weimer-six`, `loisel` and `abbas` are models" in found.note
    for name, design in (("quotient", "quotient"), ("renormalise, 3", "renormalise")):
        entries = [of for of in read_store() if of["design"] == f"pipeline {design}, blinn, 1 light"]
        entry = next(of for of in entries if of["device"] == DEVICE)
        middle = sorted(entry["fmax_mhz"])[len(entry["fmax_mhz"]) // 2]
        assert len(entry["fmax_mhz"]) % 2 == 1
        assert rows[name]["tables times ns"] == pytest.approx(1.5e3 / middle * entry["luts"])
    # The same errors: the least product alone is on the front, and only among methods with N·H.
    least = min(("quotient", "chord-local", "renormalise, 3"), key=lambda name: rows[name]["tables times ns"])
    assert [name for name, row in rows.items() if row["on the front of tables"]] == [least]


def test_each_interval_has_its_own_placement():
    found = {name: placed_of(COMPARED[name]) for name in ("renormalise, 2", "renormalise, 1", "abbas")}
    for name, entry in found.items():
        assert entry is None or entry["design"].endswith(f"interval {name[-1]}")


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.parametrize("name", ["quotient", "chord-local", "renormalise, 2"])
def test_counts_are_those_of_netlists(name):
    of = parts(name, 1, "teapot-200", (24, 18), True)
    assert of["multipliers"] == of["netlist"]


@pytest.mark.long
@pytest.mark.ci
def test_errors_of_a_small_frame():
    exact, coarse = (errors(name, "teapot-300", (48, 36), [100])[0] for name in ("duff", "abbas"))
    assert exact["max_lsb"] < 0.1 < 5 < coarse["max_lsb"]
    assert exact["share"] == 0 < coarse["share"]
    assert exact["cycles"] >= 1
