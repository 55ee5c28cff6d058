"""Statements of the paper that are not inserted from data: each has what must bear it out.

Statements of `CLAIMS` compare, and the data of the paper have to bear them out. Statements of `REPEATED` have
figures of a page of docs, and the page must have them, too.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from blysk.bench.quality.paper_drawings import STAGES
from blysk.sim.errors import InputError

__all__ = ["CLAIMS", "REPEATED", "check"]

Data = Mapping[str, Any]
"""Result of `paper.data_of`."""

DOCS = Path(__file__).parents[2] / "docs"


def _lights(data: Data, method: str) -> list[int]:
    """Multipliers of a method's netlists over the number of lights."""
    return next(row["multipliers"] for row in data["lights"]["rows"] if row["method"] == method)


def _thirteen_a_light(data: Data) -> bool:
    first, *others = _lights(data, "quotient")
    counts = data["lights"]["counts"][1:]
    return all(more == first + 13 * (count - 1) for count, more in zip(counts, others, strict=True))


def _luts(data: Data) -> list[bool]:
    """Whether `quotient` has fewer look-up tables than `renormalise`, with 1, 2 and more lights."""
    rows = data["more_lights"]["rows"]
    own, other = ([int(row[k].split(", ")[0].replace(",", "")) for row in rows] for k in (1, 2))
    return [a < b for a, b in zip(own, other, strict=True)]


def _none_beats(data: Data) -> bool:
    own, parts = data["design"], ("error", "cycles", "multipliers")
    rows = [row for row in data["methods"] if row != own]
    return not any(all(row[part] <= own[part] for part in parts) for row in rows)


def _rival(data: Data, name: str, part: str) -> list[float]:
    return next(row[part] for row in data["rivals"]["rows"] if row["method"] == name)


def _netlists_agree(data: Data) -> bool:
    rows = [row for row in data["rivals"]["rows"] if row["netlist"] is not None]
    return bool(rows) and all(row["netlist"] == row["multipliers"][0] for row in rows)


CLAIMS: Mapping[str, Callable[[Data], bool]] = {
    "With one light a pixel then takes two tables and 11 products": lambda data: (
        sum(n for _, n in STAGES[2:]) == 11 and sum(n for _, n in STAGES) == data["design"]["multipliers"]
    ),
    "No operand of a multiplier has more than 18 bits": lambda data: (
        max(row["widest"] for row in data["lights"]["rows"] if row["method"] == "quotient") <= 18
    ),
    "The pipeline gives a pixel in each cycle, whatever the length of the spans": lambda data: (
        set(_rival(data, "quotient", "cycles")) == {1}
    ),
    "It takes 13 multipliers with `blinn`": _thirteen_a_light,
    "No row is at least as good in error, cycles and multipliers together": _none_beats,
    "With one light it has more look-up tables. From two lights on it has fewer": lambda data: (
        _luts(data) == [True] + [False] * (len(_luts(data)) - 1)
        and data["renormalise"]["luts"] > data["design"]["luts"]
    ),
    "more multipliers, and #n(data.renormalise.cycles": lambda data: (
        data["renormalise"]["multipliers"] > data["design"]["multipliers"]
    ),
    "a netlist with one light confirms the count of multipliers": _netlists_agree,
    "With more lights the count may be too low": lambda data: (
        _rival(data, "quotient", "multipliers")[1] < _lights(data, "quotient")[-1]
    ),
    "is the nearest neighbour, and as exact": lambda data: (
        abs(max(_rival(data, "duff", "errors")) - max(_rival(data, "quotient", "errors"))) < 0.01
    ),
}
"""Sentences, or parts of them, that compare, and whether the data bear them out."""

REPEATED: Mapping[str, tuple[str, str]] = {
    "make 17,382 spans of 17,377 for a teapot of 992 triangles, and 5,967 of 3,863 for a teapot of 52": (
        "theory/geometry.md",
        "scanlines of triangles | 3,863 | 17,377 | 49,665 | "
        "| halved by the ratio 2 and 90 degrees | 5,967 | 17,382 |",
    ),
    "$|v| >= 1\\/(2 sqrt(5)) = 0.2236$": ("theory/quotient.md", "`1/(2 sqrt(5))` = 0.2236"),
    "and keeps $|v| >= 5\\/16$": ("theory/quotient.md", "This makes `|v|` at least 5/16"),
    "a relative error of at most $10 dot 2^(-19)$": (
        "theory/quotient.md",
        "r has a relative error of at most `10 * 2^-19`",
    ),
    "its 1,572,864 operands": ("theory/quotient.md", "its 1,572,864 operands"),
    "The sums_ are cut to 47 fraction bits": (
        "theory/quotient.md",
        "Differences are cut to 47 fraction bits",
    ),
    "at most 0.06 LSB for `blinn` and `phong`": (
        "theory/quotient.md",
        "at most 0.06 LSB for `blinn` and `phong`",
    ),
    "A search over 12,000 random spans": (
        "theory/quotient.md",
        "The 12,000 random spans have up to 257 pixels",
    ),
    "was up to 1.35 LSB off": ("theory/quotient.md", "The largest error found there is 1.35 LSB"),
    "a slope of up to 12.92": ("guide/accuracy.md", "at most 12.92"),
    "of 102,080 triangles, with 1.8 pixels a span": ("guide/methods.md", "| 102,080 | 1.8 | 1.01 |"),
    "A table of 384 entries": ("theory/quotient.md", "a table of 384 entries, and one product"),
    "grows from 0.048 to 0.055 LSB": (
        "theory/quotient.md",
        "If all words lose these bits at once, the largest error is 0.055 LSB",
    ),
    "at most 1.49 steps of an 8-bit channel for Blinn's highlight, and 5.88 for Phong's": (
        "theory/quotient.md",
        "| 4095 pixels | 0.44, 0.06, 0.10, 0.32, 1.49 | 0.19, 0.17, 0.34, 1.22, 5.88 |",
    ),
    "and 50 multipliers in all": ("theory/quotient.md", "Four lanes take 50 multipliers"),
    "1.54 pixels a cycle on the teapot of 102,080 triangles at 640x480": (
        "theory/quotient.md",
        "| 102,080 | 1.54 | 1.52 |",
    ),
    "in place of 1.46 with two lanes": ("theory/quotient.md", "| 102,080 | 1.46 | 1.45 |"),
    "a triangle takes 8 or 4 cycles": ("theory/geometry.md", "A triangle then takes 8 or 4 cycles"),
    "its tests have to find at least 95 %": ("guide/checked.md", "must find at least 95 % of the others"),
    "k#sub[a] 0.05, k#sub[d] 0.4 and k#sub[s] 0.55": ("guide/accuracy.md", "k_a 0.05, k_d 0.4, k_s 0.55"),
    "Seeds of one design differ by up to 49 MHz": (
        "guide/rivals.md",
        "The seeds of a design differ by up to 49 MHz",
    ),
    "the largest of eight searches": ("guide/accuracy.md", "the largest of seeds 1 to 8"),
    "With normals and cosines of 12 bits, and all else exact, it is up to 6.84 LSB off": (
        "guide/rivals.md",
        "| 12 bits | 0.82 / 6.58 / 53.1 | 0.80 / 6.40 / 51.4 | 0.80 / 6.61 / 49.1 | 0.87 / 6.84 / 54.1 |",
    ),
    "and in half floats up to 20.5": (
        "guide/rivals.md",
        "| half floats | 2.17 / 16.2 / 98.9 | 2.09 / 16.6 / 101 | 2.20 / 17.0 / 102 | 2.28 / 20.5 / 112 |",
    ),
    "had three rounds of work on its timing": ("guide/rivals.md", "- `quotient`: three rounds"),
    "shares those of an earlier method": (
        "guide/rivals.md",
        "it has the setup and the accumulators of the earlier method `chord`, which had several rounds",
    ),
    "0.2 or more, for `chord-local` 0.05 or more": (
        "guide/accuracy.md",
        "For `chord-local` the search also takes roughness from 0.05 on",
    ),
    "With eight lights on the teapot of 10,712 triangles, `renormalise` is on the first two fronts, too": (
        "guide/rivals.md",
        "`quotient` 37,458, `renormalise` 43,478 (interval 1) | `abbas` 115, `chord-local` 2,230, "
        "`quotient` 5,425, `renormalise` 7,168 |",
    ),
    "Interval 1 does not fit the device": (
        "guide/rivals.md",
        "Interval 1 of `renormalise` has 30 multipliers, and the device has 28",
    ),
    "The setup takes 16 cycles for a triangle": ("theory/geometry.md", "takes a triangle every 16 cycles"),
    "triangles with 8 bits below the pixel": ("theory/geometry.md", "Corners have 8 bits below the pixel"),
    "a stated mean error of 0.56 %": (
        "theory/references.md",
        "a mean error of 0.56 % against single precision",
    ),
    "Powers were computed to 8 to 10 bits": ("theory/references.md", "as published to 8 to 10 bits"),
    "GGX with roughness 0.1 was up to 0.78 LSB off, and 0.57 with roughness 0.2": (
        "guide/accuracy.md",
        "| roughness | 0.1 | 0.2 | 1 | |---|---:|---:|---:| | `ggx` | 0.78 | 0.57 |",
    ),
    "changes a pixel of the teapot by up to 2.2 LSB at n = 1000": (
        "guide/accuracy.md",
        "At n = 1000 one place of the teapot changes by 2.2 LSB",
    ),
    "Several lights with n = 1 have a bound of 2 to 3 LSB": (
        "guide/accuracy.md",
        "`blinn` at n = 1 has a bound of 2 to 3 LSB",
    ),
    "ratios of W up to 10,000 and widths up to 4095": (
        "guide/accuracy.md",
        "Ratios of W go up to 10,000 within a triangle, widths up to 4095 columns",
    ),
}
"""Sentences, or parts of them, with the page of docs that has their figures, and the words of the page."""


def check(data: Data, text: str) -> None:
    """Check the statements of the paper that are not inserted from data.

    Parameters
    ----------
    data : dict
        Result of `paper.data_of`.
    text : str
        The text of the paper.

    Raises
    ------
    InputError
        If the text lacks a statement of `CLAIMS` or `REPEATED`, or the data do not bear it out, or its page
        lacks its figures.
    """
    text = " ".join(text.split())
    for said in (*CLAIMS, *REPEATED):
        if said not in text:
            raise InputError(
                f'"{said}"', "the paper does not say this", "change paper_claims.py with the paper"
            )
    for said, holds in CLAIMS.items():
        if not holds(data):
            raise InputError(f'"{said}"', "the figures of the report are others", "change the paper")
    for said, (page, words) in REPEATED.items():
        if words not in " ".join((DOCS / page).read_text(encoding="utf-8").split()):
            raise InputError(f'"{said}"', f"docs/{page} does not say {words!r}", "change the paper")
