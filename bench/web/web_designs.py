"""Designs of the modules of the live page."""

from blysk.bench import accuracy
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.presets import METHODS

__all__ = ["ALBEDO", "COLORED", "DESIGNS", "SERVED", "TABLES"]

TABLES = ("blinn", "ggx")
"""Models of N·H with a table that the page's script can make."""

SERVED = tuple(name for name, of in METHODS.items() if not of.given_values)
"""Methods of modules.

Methods whose spans bring values of each light are left out, because the light moves. If spans bring vectors,
the page turns the vectors into the light's frame.
"""

DESIGNS = (
    *(pair for pair in accuracy.DESIGNS if pair[0] in SERVED),
    *(("quotient", "ggx"), ("renormalise", "ggx"), ("linear", "blinn")),
)
"""Method and model of each module. The rival has the model of the first module, too."""

COLORED = ("quotient", "blinn")
"""Method and model of the module with an albedo. A site with this design also has its module without an
albedo."""

ALBEDO = Albedo.of_parts(("colors", "bilinear"))
"""Albedo path of this module. It serves vertex colours, textures, and both: where a mesh lacks colours or
texture coordinates, these are white. The memory holds a texture of 64x64 texels and its levels."""
