"""Designs of the modules of the live page."""

from blysk.bench import accuracy
from blysk.golden.presets import METHODS

__all__ = ["DESIGNS", "SERVED", "TABLES"]

TABLES = ("blinn", "ggx")
"""Models of N·H with a table that the page's script can make."""

SERVED = tuple(name for name, of in METHODS.items() if not of.given_values)
"""Methods of modules. Those whose spans bring values of each light are left out: the light moves. Vectors are
turned into its frame by the page."""

DESIGNS = (
    *(pair for pair in accuracy.DESIGNS if pair[0] in SERVED),
    *(("quotient", "ggx"), ("renormalise", "ggx"), ("linear", "blinn")),
)
"""Method and model of each module; the rival has the model of the first one, too."""
