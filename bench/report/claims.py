"""Claims of documents: statements with a printed value, functions that measure the value, and a table."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from blysk.bench.report.section import Cell, Drawing, Grade, Section, Table
from blysk.bench.store import Task

__all__ = ["AGREEMENT", "Claim", "ClaimTable", "Document", "Plot", "at_least", "measured", "to_the_digits"]

AGREEMENT = 2e-3
"""Largest relative difference of two computed values that agree."""


def to_the_digits(printed: str, value: float) -> bool:
    """Whether a rounded value has every printed digit. The tolerance is half a unit of the last digit."""
    return f"{value:.{len(printed.partition('.')[2])}f}" == printed


def at_least(printed: str, value: float) -> bool:
    """Whether a value reaches the printed value, or the lower end of a range such as "0.20 to 0.35"."""
    return value >= float(printed.partition(" to ")[0])


@dataclass(frozen=True)
class Claim:
    """A statement of a document, and the function that measures its quantity.

    Parameters
    ----------
    source : str
        Document and place.
    stated : str
        The statement, in words, a formula or digits.
    quantity : str
        The measured quantity, with its unit behind a comma. With the unit % the function gives a share of 1.
    function : callable, optional
        Measures the quantity, see `Task`. Its result is a number, a text, a dictionary, or two numbers. Two
        numbers are the value by the document's statement and the measured value. ``None``: nothing is
        measured.
    settings : dict
        Arguments of the function.
    key : str
        Key of the quantity in a dictionary.
    printed : str
        Printed value, digit by digit. Empty if nothing is printed, or if the function computes the printed
        value.
    holds : callable
        Whether a value is as printed. Two computed values are held to `AGREEMENT`.
    ours : str
        Our replacement of the statement.
    kind, matter : str
        Kind of an erratum, and a name that all errata about the same matter share.
    timed : bool
        Whether the function measures a time.
    """

    source: str
    stated: str
    quantity: str
    function: Callable[..., Any] | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    key: str = ""
    printed: str = ""
    holds: Callable[[str, float], bool] = to_the_digits
    ours: str = ""
    kind: str = ""
    matter: str = ""
    timed: bool = False

    @property
    def task(self) -> Task | None:
        """The measurement, or ``None``."""
        return self.function and Task(self.function, dict(self.settings), self.timed)

    def values(self, result: Any) -> tuple[Cell, Cell]:
        """Printed and measured value, from the function's result. ``None`` stands for a missing value."""
        value = result[self.key] if self.key else result
        if isinstance(value, list | tuple):
            return tuple(value)
        if self.quantity.endswith(", %") and value is not None:
            value = 100 * value
        return self.printed or None, value

    def verdict(self, result: Any) -> bool | None:
        """Whether the measured value is as printed. ``None`` if a value is missing."""
        printed, value = self.values(result)
        if printed is None or value is None:
            return None
        if isinstance(printed, str):
            return self.holds(printed, value)
        return abs(printed - value) <= AGREEMENT * max(abs(printed), abs(value))


def measured(claims: Sequence[Claim]) -> list[Any]:
    """Results of claims with a function. Each quantity is measured once, now."""
    tasks = {_identity(claim.task): claim.task for claim in claims}
    found = {identity: task.run() for identity, task in tasks.items()}
    return [found[_identity(claim.task)] for claim in claims]


@dataclass(frozen=True)
class ClaimTable:
    """A table of claims.

    Parameters
    ----------
    name, title, note : str
        As in `Table`.
    claims : callable
        Function that gives the claims of a quick report or of a full report.
    further : dict of str to str
        Headings of further columns, each with its key in the results.
    """

    name: str
    title: str
    claims: Callable[[bool], Sequence[Claim]]
    note: str = ""
    further: Mapping[str, str] = field(default_factory=dict)

    def made(self, quick: bool, results: Mapping[str, Any]) -> Table:
        """The table, from results by task. Columns without any entry are left out."""
        rows, grades = [], []
        for claim in self.claims(quick):
            result = results[_identity(claim.task)] if claim.task else None
            printed, value = claim.values(result)
            verdict = claim.verdict(result)
            of_claim = (claim.source, claim.kind, claim.stated, claim.ours, claim.quantity)
            more = [result.get(key) for key in self.further.values()] if self.further else []
            rows.append([*of_claim, printed, value, verdict, *more])
            grade: Grade = "" if verdict is None else "good" if verdict else "bad"
            grades.append([""] * _VERDICT + [grade] + [""] * len(more))
        columns = (*_COLUMNS, *self.further)
        used = [k for k in range(len(columns)) if any(row[k] not in ("", None) for row in rows)]
        rows, grades = ([[row[k] for k in used] for row in each] for each in (rows, grades))
        return Table(self.name, self.title, [columns[k] for k in used], rows, self.note, grades)


_COLUMNS = ("source", "kind", "stated", "our replacement", "quantity", "printed", "measured", "as printed")
_VERDICT = _COLUMNS.index("as printed")


@dataclass(frozen=True)
class Plot:
    """A drawing that no table replaces.

    Parameters
    ----------
    tasks : callable
        Function that gives the measurements of a quick report or of a full report.
    draw : callable
        Function that makes the drawing from the results of the measurements.
    """

    tasks: Callable[[bool], Sequence[Task]]
    draw: Callable[[list[Any]], Drawing]


@dataclass(frozen=True)
class Document:
    """A section of the report: claims of a document in tables, and plots.

    Parameters
    ----------
    name, title, text, appendix
        As in `Section`. A sentence about the confirmed printed values follows the text.
    tables : sequence of ClaimTable
        Tables of the document's claims.
    plots : sequence of Plot
        Drawings of the section.
    """

    name: str
    title: str
    text: Sequence[str]
    tables: Sequence[ClaimTable]
    plots: Sequence[Plot] = ()
    appendix: bool = True

    def tasks(self, quick: bool) -> list[Task]:
        """Measurements of a quick report or of a full report, each once."""
        claims = [claim for table in self.tables for claim in table.claims(quick)]
        found = [claim.task for claim in claims if claim.task]
        found += [task for plot in self.plots for task in plot.tasks(quick)]
        return list({_identity(task): task for task in found}.values())

    def section(self, tasks: Sequence[Task], results: Sequence[Any]) -> Section:
        """The section from the results of `tasks`, quick or not."""
        quick = list(tasks) == self.tasks(quick=True)
        found = {_identity(task): result for task, result in zip(tasks, results, strict=True)}
        tables = [table.made(quick, found) for table in self.tables]
        verdicts = [row["as printed"] for table in tables for row in table.records() if "as printed" in row]
        verdicts = [verdict for verdict in verdicts if verdict is not None]
        text = [*self.text]
        if verdicts:
            text.append(
                f"{sum(verdicts)} of {len(verdicts)} printed values come out as printed. Where we compute "
                "the printed value from the document's statement, both values may differ by "
                f"{AGREEMENT:.1%}."
            )
        plots = [plot.draw([found[_identity(task)] for task in plot.tasks(quick)]) for plot in self.plots]
        return Section(self.name, self.title, text, [*tables, *plots], appendix=self.appendix)


def _identity(task: Task) -> str:
    return json.dumps([task.name, task.settings], sort_keys=True)
