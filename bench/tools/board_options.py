"""Options of a board's scene and design."""

from blysk.golden.video.band_buffer import RGB565, RGB888
from blysk.sim.api.options import DESIGN, SCENE

__all__ = ["COLOURS", "DEFAULTS", "DEFAULT_COLOURS", "LOADERS", "OPTIONS"]

COLOURS = {"rgb565": RGB565, "rgb888": RGB888}
"""Pixel formats of the band buffer."""

DEFAULT_COLOURS = "rgb888"
"""Pixel format without an option."""

LOADERS = ("uart", "flash", "both")
"""Sources of a loader's bytes."""

_LEFT_OUT = ("size", "projection", "viewer", "target", "operand", "gate", "setup_interval", "style")

DEFAULTS = {"triangles": 1000, "back_faces": "cull"}
"""Defaults that differ from the defaults of a rendering."""

_METHOD = (
    "Method of interpolation along a span.  [default: quotient; renormalise with a model without a table]"
)

OPTIONS = {
    name: option._replace(default=DEFAULTS.get(name, option.default))
    for name, option in {**SCENE, **DESIGN, "method": DESIGN["method"]._replace(help=_METHOD)}.items()
    if name not in _LEFT_OUT
}
"""Options of the command, with the defaults in its help.

There is no option for size and projection: a board has the display's size, and a camera with perspective.
"""
