"""What a section of the report holds: text, tables and drawings, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

__all__ = ["Cell", "Conclusion", "Drawing", "Grade", "Mark", "Section", "Table"]

Cell = str | int | float | bool | None
"""Of a table. ``None``: there is no such figure."""

Grade = Literal["", "good", "fair", "poor", "bad"]
"""How the cell of a table is coloured; what each means stands in the table's note."""

Mark = Literal["", "stated", "silent"]
"""What else is to say of an error: it is stated in the documentation or flagged; or nothing tells of it."""


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
    marks : sequence of sequences of marks, optional
        One a cell.
    """

    name: str
    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    grades: Sequence[Sequence[Grade]] | None = None
    marks: Sequence[Sequence[Mark]] | None = None

    def __post_init__(self):
        widths = {len(row) for row in self.rows} | {len(row) for row in self.grades or ()}
        widths |= {len(row) for row in self.marks or ()}
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
class Conclusion:
    """What a section comes to, at the top of the report: a sentence with its figures, and a drawing.

    Parameters
    ----------
    title : str
        The question, in a few words.
    sentence : str
        The answer, as Markdown, made from the measurements.
    drawing : Drawing
        Which shows it.
    """

    title: str
    sentence: str
    drawing: Drawing


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
    conclusion : Conclusion, optional
        What it comes to, if that stands at the top.
    appendix : bool
        Whether it is for those who check the documents, and so comes last.
    """

    name: str
    title: str
    text: Sequence[str]
    parts: Sequence[Table | Drawing]
    figures: dict[str, Any] = field(default_factory=dict)
    conclusion: Conclusion | None = None
    appendix: bool = False
