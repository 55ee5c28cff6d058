"""Tables and references that the paper takes from pages."""

import pytest

from blysk.bench.quality.paper_pages import (
    checkers_of,
    cited,
    columns,
    documents_table,
    materials_of,
    reference_texts,
)
from blysk.sim.errors import InputError


def test_cited_keys():
    assert cited('a #cite("Duff79", "C") b #cite("C") #cite("DEC90").') == ["C", "DEC90", "Duff79"]


def test_references():
    page = "### [A1]\n\nB. C, *D_e*, 10.1/x#2,\npages 1 to 2.\n\n### [F]\n\nG.\n"
    assert list(reference_texts(["A1"], page)) == [
        {"key": "A1", "text": "B. C, _D\\_e_, 10.1/x\\#2, pages 1 to 2."}
    ]
    with pytest.raises(InputError, match=r"\[Z\]: docs/theory/references.md has no entry"):
        list(reference_texts(["Z"], page))


def test_tables_of_pages():
    page = "x\n\n| a | b |\n|---|---:|\n| `c` | d \\| [e](f.md) |\n| g | h |\n\ny\n"
    found = documents_table(page, "| a | b |")
    assert found == {"header": ["a", "b"], "rows": [["`c`", "d | e"], ["g", "h"]]}
    assert columns(found, 1) == {"header": ["b"], "rows": [["d | e"], ["h"]]}
    with pytest.raises(InputError, match="no table of the page begins with"):
        documents_table(page, "| z |")


def test_materials():
    head = (
        "\n| material | `quotient`: table | frame | bound | `chord-local`: table | frame |\n|-|-|-|-|-|-|\n"
    )
    other = "\n\n| material | mean | 99 % | largest | mean, F |\n|-|-|-|-|-|\n"
    page = f"{head}| `a` | 1 | 2 | 3 | 4 | 5 |{other}| `a` | 6 | 7 | 8 | 9 |\n"
    assert materials_of(page) == [["`a`", "1", "2", "3", "6", "8"]]


def test_checkers():
    rows = [["torus", "9", "9", "9", "9"], ["floor, a", "1", "2", "3", "4"], ["floor, b", "2", "1", "1", "5"]]
    assert checkers_of({"rows": rows}) == {"linear": 2, "linear_bound": 2, "srgb": 3, "srgb_bound": 5}
