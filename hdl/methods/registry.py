"""Unit of each method, found in the files of this package."""

import pkgutil

from blysk.golden.methods.interpolator import Interpolator
from blysk.hdl import methods
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["unit_of"]

for _module in pkgutil.iter_modules(methods.__path__):
    if _module.name.endswith("_interpolator"):
        pkgutil.resolve_name(f"{methods.__name__}.{_module.name}")


def unit_of(model: Interpolator) -> type[InterpolatorUnit]:
    """Class of the unit of a method.

    Parameters
    ----------
    model : Interpolator
        Bit-accurate model of the method.

    Raises
    ------
    TypeError
        If the method has no unit.
    """
    method = type(model)
    if method not in InterpolatorUnit.UNITS:
        raise TypeError(
            f"{method.__name__} has no unit: its module, or a file *_interpolator.py of {methods.__name__}, "
            f"needs a class with model={method.__name__}"
        )
    return InterpolatorUnit.UNITS[method]
