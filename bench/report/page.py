"""The report as one page of HTML: its template, and numbers in readable form."""

import base64
import functools
import importlib.util
import json
import math
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from blysk.bench.report.section import Cell, Section, Table
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

__all__ = [
    "AXES",
    "embedded",
    "environment",
    "page",
    "shown",
    "without_pictures",
]


AXES = {
    "total": "Error against the exact frame: Phong shading as on a GPU, with Blinn's model.",
    "method": "Error against exact normals of every pixel, with the same model.",
    "arithmetic": "Error against the same method and model in float64, caused by the widths of words.",
    "model": "Error of the reflection model against Blinn's, both exact in float64. Arithmetic does not "
    "change this error.",
    "max_lsb": "The largest error over all pixels and channels. 1 LSB is a step of an 8-bit channel of "
    "linear light.",
    "p999_lsb": "One value in a thousand has a larger error. 1 LSB is a step of an 8-bit channel of "
    "linear light.",
    "rmse_lsb": "Root of the mean square over pixels and channels. 1 LSB is a step of an 8-bit channel of "
    "linear light.",
    "psnr_db": "Peak signal to noise ratio. More is better, so the axis is reversed.",
    "flip_p99": "FLIP, the difference that an eye sees, 0 to 1. One pixel in a hundred has a larger value.",
    "flip_max": "FLIP, the difference that an eye sees, 0 to 1. The value of the worst pixel.",
    "ciede2000_p99": "CIEDE2000 colour difference. An eye just notices about 2.3. One pixel in a hundred has "
    "a larger value.",
    "ciede2000_max": "CIEDE2000 colour difference. An eye just notices about 2.3. The value of the worst "
    "pixel.",
    "cycles_per_pixel": "Cycles of the simulated pipeline from the first write of a constant to the last "
    "pixel, divided by the number of pixels.",
    "ns_per_pixel": "Cycles a pixel at the clock rate after place and route.",
    "multipliers": "Multipliers of 18x18 bits in the netlist. None is shared with other logic.",
    "luts": "Look-up tables of four inputs after place and route, one light, three channels.",
    "simulated_pixels_per_second": "Speed at which this machine simulates the hardware. More is better, so "
    "the axis is reversed.",
    "golden_ns_per_pixel": "Time of the same method and model in float64 NumPy on this machine, divided by "
    "the shown pixels.",
}
"""Explanations of a point's measures, a sentence each: by kind of error, by figure, and by run time."""

_DIGITS = 4
"""Significant digits of a number in the page."""


# The page.


def shown(value: Cell) -> str:
    """Text of a value: numbers with four significant digits and separated thousands.

    Parameters
    ----------
    value : text, number or None
        A cell of a table.
    """
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f") if abs(value) >= 10_000 else str(value)
    if not isinstance(value, float):
        return str(value)
    if not math.isfinite(value):
        return str(value).replace("inf", "∞")
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        digits = _DIGITS - 1 - (math.floor(math.log10(abs(value))) if value else 0)
        text = f"{round(value, digits):,.{max(digits, 0)}f}" if value else "0"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        return text.replace(",", "" if abs(value) < 10_000 else "\u202f").replace("-", "−")
    mantissa, exponent = f"{value:.{_DIGITS - 1}e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa.replace('-', '−')}·10{power}"


def _is_number(value: Cell) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _kinds(table: Table) -> list[str]:
    """Class of each column: a number, a short text or a long text."""
    kinds = []
    for cells in zip(*table.rows, strict=True) if table.rows else [()] * len(table.columns):
        there = [cell for cell in cells if cell is not None]
        long = max((len(shown(cell)) for cell in there), default=0) > 40
        kinds.append("number" if all(map(_is_number, there)) else "long" if long else "text")
    return kinds


def _data_uri(svg: str) -> str:
    """A drawing as a data URI, so that its class names do not act on the page."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"


def embedded(value: Any) -> str:
    """JSON of a value, safe inside a script element.

    Parameters
    ----------
    value
        A value that JSON can hold.
    """
    return json.dumps(value, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")


def without_pictures(value: Any) -> Any:
    """Figures without their pictures, because the page already has the pictures."""
    if isinstance(value, Mapping):
        return {
            key: without_pictures(item)
            for key, item in value.items()
            if not (isinstance(item, str) and item.startswith("data:"))
        }
    return [without_pictures(item) for item in value] if isinstance(value, list | tuple) else value


def _missing(name: str) -> InputError:
    return InputError("bench", f"{name} is not installed", install_extra("report"))


@functools.cache
def environment(*packages: str) -> Any:
    """Jinja's environment of the pages, with their filters.

    Parameters
    ----------
    *packages : str
        Packages with further templates.

    Raises
    ------
    InputError
        If a library of the ``report`` extra is missing.
    """
    try:
        from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
        from markdown_it import MarkdownIt
        from markupsafe import Markup
    except ImportError as error:
        raise _missing(error.name) from None
    for name in ("flip_evaluator", "skimage"):
        if importlib.util.find_spec(name) is None:
            raise _missing(name)
    markdown = MarkdownIt("commonmark", {"html": False})
    found = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in ("blysk.bench.report", *packages)]),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
    )
    found.filters |= {
        "markdown": lambda text: Markup(markdown.render(text)),
        "inline": lambda text: Markup(markdown.renderInline(text)),
        "shown": shown,
        "kinds": _kinds,
        "data_uri": _data_uri,
        "embedded": lambda value: Markup(embedded(value)),
    }
    found.tests["table"] = lambda part: isinstance(part, Table)
    found.tests["number"] = _is_number
    return found


def page(sections: Sequence[Section], about: Mapping[str, Any]) -> str:
    """The report as one page of HTML.

    Parameters
    ----------
    sections : sequence of Section
        Sections in their order, appendices last. A section with ``points`` among its figures (see
        `points.section`) gets the drawing of error against run time. Conclusions are at the top.
    about : dict
        See `report.about`.

    Raises
    ------
    InputError
        If a library of the ``report`` extra is missing.
    """
    texts = {
        name: resources.files(__package__).joinpath("templates", f"report.{name}").read_text(encoding="utf-8")
        for name in ("css", "js")
    }
    (explored,) = [section for section in sections if "points" in section.figures] or (None,)
    figures = without_pictures(explored.figures) if explored else None
    template = environment().get_template("report.html")
    ordered = [section for section in sections if not section.appendix]
    ordered += [section for section in sections if section.appendix]
    conclusions = [section for section in ordered if section.conclusion]
    return template.render(
        sections=ordered,
        conclusions=conclusions,
        about=about,
        explored=explored,
        figures=figures,
        axes=AXES,
        **texts,
    )
