"""Parts of a section of the report: text, tables and drawings, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

__all__ = ["Cell", "Conclusion", "Drawing", "Grade", "Mark", "Section", "Table"]

Cell = str | int | float | bool | None
"""Value of a table's cell. ``None``: there is no figure."""

Grade = Literal["", "good", "fair", "poor", "bad"]
"""Colour of a table's cell. The table's note explains each colour."""

Mark = Literal["", "stated", "silent"]
"""Mark of an error: ``stated`` (in the documentation, or flagged) or ``silent`` (without any sign)."""


@dataclass(frozen=True)
class Table:
    """Table of figures. The page shows it, and it is written as CSV and JSON under its name.

    Parameters
    ----------
    name : str
        Name of its files, in small letters with dashes.
    title : str
        One line.
    columns : sequence of str
        Headings, with the unit behind a comma: "largest error, LSB".
    rows : sequence of sequences of cells
        Figures, not rounded. The page rounds them.
    note : str
        One or more sentences on the quantity and its measurement.
    grades : sequence of sequences of grades, optional
        A grade for each cell.
    marks : sequence of sequences of marks, optional
        A mark for each cell.
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
    """A drawing, with its title and a note.

    Parameters
    ----------
    name : str
        Name of its file, in small letters with dashes.
    title : str
        One line that names the quantities of both axes.
    svg : str
        The drawing; see `svg`.
    note : str
        The main finding in the drawing, and the place of the published figure.
    """

    name: str
    title: str
    svg: str
    note: str = ""


@dataclass(frozen=True)
class Conclusion:
    """Conclusion of a section, at the top of the report, with a sentence, its figures and a drawing.

    Parameters
    ----------
    title : str
        The question, in a few words.
    sentence : str
        The answer, as Markdown, made from the measurements.
    drawing : Drawing
        Drawing of the answer.
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
        Name of its anchor, in small letters with dashes.
    title : str
        Heading.
    text : sequence of str
        Paragraphs, as Markdown without headings: emphasis, code, links.
    parts : sequence of Table, Drawing
        In the order of the page.
    figures : dict
        Further values for the page's script and other programs. They are plain values for JSON.
    conclusion : Conclusion, optional
        Its conclusion, if the top of the report has one.
    appendix : bool
        Whether the section is only for readers who check the documents. It then comes last.
    """

    name: str
    title: str
    text: Sequence[str]
    parts: Sequence[Table | Drawing]
    figures: dict[str, Any] = field(default_factory=dict)
    conclusion: Conclusion | None = None
    appendix: bool = False
