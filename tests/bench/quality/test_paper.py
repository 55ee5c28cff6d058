"""The paper: its citations, the tables that it takes from pages, its table of methods, its PDF."""

import json
import re

import pytest

from blysk.bench.quality import paper as module
from blysk.bench.quality.paper import (
    OF_LIGHTS,
    SHOWN,
    SOURCE,
    cited,
    columns,
    data_of,
    documents_table,
    main,
    methods_of,
    paper,
    reference_texts,
    rivals_of,
)


def point(method, model, error, cycles, exponent=100):
    """A point of a report with made-up figures."""
    settings = {"source": "teapot", "triangles": 992, "width": 320, "height": 240, "exponent": exponent}
    return {
        "settings": settings | {"method": method, "model": model},
        "errors": {"method_max_lsb": error},
        "times": {"cycles_per_pixel": cycles},
        "hardware": {"multipliers": 20},
    }


def report():
    """A report with made-up figures of three methods."""
    points = [point("renormalise", "blinn", 0.53, 1.2), point("quotient", "blinn", 0.52, 1.0)]
    points += [point("linear", "cosquad", 90.0, 1.3), point("quotient", "blinn", 0.6, 1.0, exponent=10)]
    versions = {"blysk": "0.1.0", "Python": "3.11", "amaranth": "0.5", "numpy": "2"}
    parts = [
        {"method": name, "lights": lights, "multipliers": 9 * lights, "adders, bits": 700}
        for name in ("duff", "renormalise")
        for lights in (1, 8)
    ]
    errors = [
        {"method": name, "mesh": "ring", "exponent": exponent, "largest error before rounding, LSB": 0.25}
        for name in ("duff", "renormalise")
        for exponent in (10, 100)
    ]
    tables = {"rivals-parts": {"rows": parts}, "rivals-errors": {"rows": errors}}
    figures = {"points": {"figures": {"points": points}}, "rivals": {"tables": tables}}
    return {"made": "2026-11-27T10:00:00+00:00", "versions": versions, "sections": figures}


def test_cited_keys():
    assert cited('a #cite("Duff79", "C") b #cite("C") #cite("DEC90").') == ["C", "DEC90", "Duff79"]


def test_references():
    page = "### [A1]\n\nB. C, *D_e*, 10.1/x#2,\npages 1 to 2.\n\n### [F]\n\nG.\n"
    assert list(reference_texts(["A1"], page)) == [
        {"key": "A1", "text": "B. C, _D\\_e_, 10.1/x\\#2, pages 1 to 2."}
    ]
    with pytest.raises(ValueError, match="the paper cites Z, and"):
        list(reference_texts(["Z"], page))


def test_tables_of_pages():
    page = "x\n\n| a | b |\n|---|---:|\n| `c` | d \\| [e](f.md) |\n| g | h |\n\ny\n"
    found = documents_table(page, "| a | b |")
    assert found == {"header": ["a", "b"], "rows": [["`c`", "d | e"], ["g", "h"]]}
    assert columns(found, 1) == {"header": ["b"], "rows": [["d | e"], ["h"]]}
    with pytest.raises(ValueError, match="no table begins with"):
        documents_table(page, "| z |")


def test_table_of_methods():
    """The smallest error is first. Parts come from the store of placements."""
    rows = methods_of(report()["sections"]["points"]["figures"]["points"])
    assert [(row["method"], row["error"]) for row in rows] == [
        ("quotient", 0.52),
        ("renormalise", 0.53),
        ("linear", 90.0),
    ]
    assert all(row["luts"] > 1000 and row["mhz"] > 50 for row in rows)
    with pytest.raises(ValueError, match="are not in the report"):
        methods_of([point("linear", "cosquad", 90.0, 1.3)])


def test_table_of_rivals():
    found = rivals_of(report()["sections"]["rivals"]["tables"])
    assert (found["meshes"], found["most"]) == (["ring"], 8)
    assert found["rows"][0] == {"method": "duff", "multipliers": [9, 72], "adders": 700, "errors": [0.25]}


def test_all_sources_of_the_paper_are_there():
    """Each citation has its entry, and each reference of the list is cited."""
    data = data_of(report())
    assert [entry["key"] for entry in data["references"]] == cited(SOURCE.read_text(encoding="utf-8"))
    assert len(data["references"]) > 30
    names = set(re.findall(r"data\.(?!json)(\w+)", SOURCE.read_text(encoding="utf-8")))
    assert names <= data.keys() | {"exponents", "lights"}


@pytest.mark.ci
@pytest.mark.long
def test_the_paper_has_at_most_eight_pages(tmp_path):
    """Typst sets the text without a warning."""
    typst = pytest.importorskip("typst", reason="the extra paper is missing")
    errors = [(0.5, 0.6)] * len(SHOWN)
    exponents = {"triangles": 992, "size": "320x240", "blinn": errors, "phong": errors}
    rows = [{"method": name, "interval": 3, "multipliers": [16]} for name in OF_LIGHTS]
    made = paper(report(), tmp_path, exponents, {"counts": [1], "rows": rows})
    assert made.startswith(b"%PDF")
    pages, warnings = typst.compile_with_warnings(
        tmp_path / SOURCE.name, format="png", ppi=20, ignore_system_fonts=True
    )
    assert not warnings
    assert 4 <= len(pages) <= 8


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (None, "is not such a report; give the report.json of `blysk bench --only points --only rivals`"),
        ("{}", "is not such a report"),
        (json.dumps({"sections": {"points": {"figures": {"points": []}}}}), "are not in the report"),
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


@pytest.mark.long
def test_multipliers_of_the_table_of_lights():
    """Multipliers of the table of lights are those of the netlist; `quotient` with one light has 16."""
    assert module.lights_of(("quotient",), (1,))["rows"] == [
        {"method": "quotient", "interval": 3, "multipliers": [16]}
    ]
