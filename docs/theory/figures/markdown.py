"""Markdown tables."""

from collections.abc import Iterable, Sequence

__all__ = ["table"]


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers_from: int = 1) -> str:
    """A table of GitHub's Markdown.

    Parameters
    ----------
    head : sequence of str
        Titles of the columns.
    rows : iterable of sequences of str
        Cells.
    numbers_from : int
        First of the columns that are set flush right.
    """
    rule = ["---" if k < numbers_from else "---:" for k in range(len(head))]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, rule, *rows))
