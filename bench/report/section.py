"""What a section of the report holds: text, tables and drawings, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

__all__ = ["Cell", "Drawing", "Grade", "Section", "Table"]

Cell = str | int | float | bool | None
"""Of a table. ``None``: there is no such figure."""

Grade = Literal["", "good", "fair", "bad"]
"""How the cell of a table is coloured; what each means stands in the table's note."""


@dataclass(frozen=True)
class Table:
    """Rows of figures: shown in the page, and written as CSV and JSON under its name.

    Parameters
    ----------
    name : str
        Of its files, in small letters with dashes.
    title : str
        One line.
    columns : sequence of str
        Headings, with the unit behind a comma: "largest error, LSB".
    rows : sequence of sequences of cells
        Figures as they are, not rounded: the page rounds them.
    note : str
        What was measured, and how: a sentence or some.
    grades : sequence of sequences of grades, optional
        One a cell.
    """

    name: str
    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    grades: Sequence[Sequence[Grade]] | None = None

    def __post_init__(self):
        widths = {len(row) for row in self.rows} | {len(row) for row in self.grades or ()}
        if widths - {len(self.columns)}:
            raise ValueError(f"a row of table {self.name} has not {len(self.columns)} cells")
        if self.grades is not None and len(self.grades) != len(self.rows):
            raise ValueError(f"table {self.name} has {len(self.rows)} rows and {len(self.grades)} of grades")

    def records(self) -> list[dict[str, Cell]]:
        """Rows as dictionaries by heading."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]


@dataclass(frozen=True)
class Drawing:
    """A drawing, and the figures in it.

    Parameters
    ----------
    name : str
        Of its file, in small letters with dashes.
    title : str
        One line: what is drawn against what.
    svg : str
        The drawing; see `svg`.
    note : str
        What a reader should see in it; where the published figure is.
    """

    name: str
    title: str
    svg: str
    note: str = ""


@dataclass(frozen=True)
class Section:
    """A section of the report.

    Parameters
    ----------
    name : str
        Of its anchor, in small letters with dashes.
    title : str
        Heading.
    text : sequence of str
        Paragraphs, as Markdown without headings: emphasis, code, links.
    parts : sequence of Table, Drawing
        In the order of the page.
    figures : dict
        What the page's script or other programs read besides the tables; plain values for JSON.
    """

    name: str
    title: str
    text: Sequence[str]
    parts: Sequence[Table | Drawing]
    figures: dict[str, Any] = field(default_factory=dict)
