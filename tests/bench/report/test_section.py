"""Tables of the report have the columns and cells that they state."""

import pytest

from blysk.bench.report.section import Table


def test_records():
    table = Table("errors", "Errors", ("method", "error, LSB"), (("quotient", 0.5), ("linear", None)))
    assert table.records() == [
        {"method": "quotient", "error, LSB": 0.5},
        {"method": "linear", "error, LSB": None},
    ]


@pytest.mark.parametrize(
    ("rows", "grades"), [((("a",),), None), ((("a", 1),), (("good",),)), ((("a", 1),), ()), ((), (("", ""),))]
)
def test_rows_that_do_not_fit(rows, grades):
    with pytest.raises(ValueError, match="table errors"):
        Table("errors", "Errors", ("method", "error"), rows, grades=grades)
