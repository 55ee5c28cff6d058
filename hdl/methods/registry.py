"""Unit of each method, found in the files of this package."""

import pkgutil

from blysk.golden.methods.interpolator import Interpolator
from blysk.hdl import methods
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["unit_of"]

for _module in pkgutil.iter_modules(methods.__path__):
    if _module.name.endswith("_interpolator"):
        pkgutil.resolve_name(f"{methods.__name__}.{_module.name}")


def unit_of(parameters: Interpolator) -> type[InterpolatorUnit]:
    """Class of the unit of a method.

    Parameters
    ----------
    parameters : Interpolator
        Bit-accurate model of the method.
    """
    return InterpolatorUnit.UNITS[type(parameters)]
