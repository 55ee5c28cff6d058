"""The paper: its tables of methods and of rivals, its PDF, and the faults of its inputs."""

import json
import re

import pytest

from blysk.bench.quality import paper as module
from blysk.bench.quality.paper import (
    OF_LIGHTS,
    SHOWN,
    SOURCE,
    beside,
    data_of,
    main,
    measured_of,
    paper,
    rivals_of,
)
from blysk.bench.quality.paper_pages import cited
from blysk.golden.presets import METHODS

FORMS = [("quotient", "blinn"), ("quotient", "phong"), ("renormalise", "cosquad")]
FORMS += [(method, "blinn") for method in METHODS if method != "quotient"]
"""Method and model of the made-up rows."""


def row(k, method, model):
    """A row of the section `methods`, with made-up figures."""
    found = {"method": method, "model": model, "operand": METHODS[method].operand, "engine": "cxxrtl"}
    found |= {
        "error": 0.52 + k / 100,
        "cycles": 1 + k / 100,
        "multipliers": 16 if method == "quotient" else 24,
    }
    luts = 4000 if method == "renormalise" else 3000 + k
    return found | {"luts": luts, "flip_flops": 2000, "mhz": 150, "seeds": 3, "date": "2026-11-27"}


def report():
    """A report with made-up figures of all methods and two rivals."""
    rows = [row(k, *form) for k, form in enumerate(FORMS)]
    scene = {"triangles": 1000, "size": "320x240", "exponent": 100}
    versions = {"blysk": "0.1.0", "Python": "3.11", "amaranth": "0.5", "numpy": "2"}
    meshes = "teapot, 992 triangles", "torus, 14,400 triangles"
    names = {"quotient": 16, "duff": 18, "bishop-weimer-six": 7, "renormalise, 3": 24}
    parts = [
        {
            "method": name,
            "lights": lights,
            "multipliers": count + 12 * (lights - 1),
            "adders, bits": 700,
            "area, bits of adders": 324 * count + 700,
            "beat": "span",
            "bits a beat": 112,
            "multipliers of the netlist": count if name in ("quotient", "renormalise, 3") else None,
        }
        for name, count in names.items()
        for lights in (1, 8)
    ]
    errors = [
        {
            "method": name,
            "mesh": mesh,
            "exponent": exponent,
            "largest error before rounding, LSB": 0.25,
            "cycles a pixel": 1 + (name == "duff") * k,
            "switched bits a pixel": None if name == "duff" else names[name],
        }
        for name in names
        for k, mesh in enumerate(meshes)
        for exponent in (10, 100)
    ]
    kinds = "multiplications", "additions", "divisions", "roots", "functions"
    work = {f"{kind} a {rate}": k for rate in ("triangle", "span") for k, kind in enumerate(kinds, 1)}
    hosts = [{"method": name, "lights": 1} | work for name in names]
    placed = [
        {"method": name, "mesh": mesh, "tables times ns": time, "on the front of tables": name != "duff"}
        for mesh in meshes
        for name, time in (("quotient", 9), ("duff", 1), ("chord-local", 8))
    ]
    tables = {"parts": parts, "errors": errors, "host": hosts, "placed": placed}
    tables = {f"rivals-{name}": {"rows": rows} for name, rows in tables.items()}
    figures = {"methods": {"figures": {"rows": rows, "scene": scene}}, "rivals": {"tables": tables}}
    return {"made": "2026-11-27T10:00:00+00:00", "versions": versions, "sections": figures}


def measured():
    """What the paper measures, made up."""
    errors = [(0.5, 0.6)] * len(SHOWN)
    exponents = {"triangles": 992, "size": "320x240", "blinn": errors, "phong": errors}
    counts = [1, 2, 4, 8]
    rows = [
        {
            "method": name,
            "interval": 3,
            "multipliers": [16 + 13 * (count - 1) for count in counts],
            "widest": 18,
        }
        for name in OF_LIGHTS
    ]
    return measured_of(report()) | {"exponents": exponents, "lights": {"counts": counts, "rows": rows}}


def test_methods_beside_another():
    own = {"method": "a", "model": "x", "error": 0.514, "cycles": 1.0041, "multipliers": 16, "luts": 9}
    rows = [
        own,
        own | {"model": "y", "cycles": 1.003},
        own | {"method": "b", "error": 0.511, "multipliers": 17, "luts": None},
        own | {"method": "c", "error": 0.504, "cycles": 2, "multipliers": 15},
        own | {"method": "c", "multipliers": 16, "luts": 8},
    ]
    assert beside(rows, own) == {
        "error": {"less": ["c"], "same": ["a/y", "b"]},
        "cycles": {"less": ["a/y"], "same": ["b", "c"]},
        "multipliers": {"less": ["c"], "same": ["a/y"]},
        "luts": {"less": ["c"], "same": ["a/y"]},
    }


def test_table_of_rivals():
    found = rivals_of(report()["sections"]["rivals"]["tables"], 100)
    assert found["meshes"] == ["teapot, 992 triangles", "torus, 14,400 triangles"]
    assert found["most"] == 8
    assert found["rows"][1] == {
        "method": "duff",
        "multipliers": [18, 102],
        "adders": 700,
        "area": 6532,
        "netlist": None,
        "beat": "112 a span",
        "host": [[1, 2, 12], [1, 2, 12]],
        "errors": [0.25, 0.25],
        "cycles": [1, 2],
        "switched": [None, None],
    }
    fronts = {"area": ["bishop-weimer-six"], "switched": ["bishop-weimer-six"]}
    fronts["placed"] = ["chord-local", "quotient"]
    assert found["fronts"] == {name: [front] * 2 for name, front in fronts.items()}


def test_all_sources_of_the_paper_are_there():
    """Each citation has its entry, and each reference of the list is cited."""
    data = data_of(measured())
    assert [entry["key"] for entry in data["references"]] == cited(SOURCE.read_text(encoding="utf-8"))
    assert len(data["references"]) > 30
    assert set(re.findall(r"data\.(?!json)(\w+)", SOURCE.read_text(encoding="utf-8"))) <= data.keys() | {
        "above"
    }
    assert data["scene"]["triangles"] == 992


@pytest.mark.ci
@pytest.mark.long
def test_the_paper_has_at_most_eight_pages(tmp_path):
    """Typst sets the text without a warning."""
    typst = pytest.importorskip("typst", reason="the extra paper is missing")
    made = paper(data_of(measured()), tmp_path)
    assert made.startswith(b"%PDF")
    pages, warnings = typst.compile_with_warnings(
        tmp_path / SOURCE.name, format="png", ppi=20, ignore_system_fonts=True
    )
    assert not warnings
    assert 4 <= len(pages) <= 8


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (None, "is not such a report; give the report.json of `blysk bench --only methods --only rivals`"),
        ("{", "is not such a report"),
        ("[]", "is not such a report"),
        ("{}", "is not such a report"),
        (json.dumps({"sections": {"methods": {"figures": {"rows": []}}}}), "is not such a report"),
        (json.dumps(report() | {"versions": {}}), "is not such a report"),
    ],
)
def test_a_file_that_is_no_report(content, line, tmp_path, capsys):
    file = tmp_path / "report.json"
    if content is not None:
        file.write_text(content)
    assert main([str(file), "-o", str(tmp_path / "paper.pdf")]) == 2
    told = capsys.readouterr().err
    assert line in told
    assert told.count("\n") == 1
    assert not (tmp_path / "paper.pdf").exists()


def test_a_fault_of_a_page_is_told_as_such(tmp_path, capsys, monkeypatch):
    """Not as a fault of the report."""
    file = tmp_path / "report.json"
    file.write_text(json.dumps(report()))
    of_lights = measured()
    monkeypatch.setattr(module, "exponents_of", lambda *_: of_lights["exponents"])
    monkeypatch.setattr(module, "lights_of", lambda: of_lights["lights"])
    monkeypatch.setattr(module, "cited", lambda text: ["Nobody99"])
    assert main([str(file), "-o", str(tmp_path / "paper.pdf")]) == 2
    told = capsys.readouterr().err
    assert "[Nobody99]: docs/theory/references.md has no entry of it; write the entry" in told
    assert told.count("\n") == 1


@pytest.mark.long
def test_multipliers_of_the_table_of_lights():
    """Multipliers of the table of lights are those of the netlist; `quotient` with one light has 16."""
    assert module.lights_of(("quotient",), (1,))["rows"] == [
        {"method": "quotient", "interval": 3, "multipliers": [16], "widest": 18}
    ]
