"""Designs by name: the methods and reflection models of the command line, the API and the tables."""

from dataclasses import fields, replace

from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods import (
    angular_interpolator,
    bisection_interpolator,
    chord_interpolator,
    linear_interpolator,
    local_chord_interpolator,
    quadratic_interpolator,
    recurrence_interpolator,
    renormalise_interpolator,
)
from blysk.golden.methods.interpolator import Interpolator, NormalInterpolator, Operand
from blysk.golden.pipeline import Build, Design
from blysk.golden.reference.reflection import REFLECTION_MODELS

__all__ = ["METHODS", "MODELS", "PUBLISHED", "preset"]

_MODULES = (
    linear_interpolator,
    renormalise_interpolator,
    bisection_interpolator,
    quadratic_interpolator,
    angular_interpolator,
    recurrence_interpolator,
    chord_interpolator,
    local_chord_interpolator,
)
"""Modules of the methods, in the order of tables, with their ``METHODS`` and perhaps ``PUBLISHED``."""

METHODS: dict[str, Interpolator] = {method.name: method for module in _MODULES for method in module.METHODS}
"""Interpolation methods."""

PUBLISHED: dict[str, Interpolator] = {
    method.name: method for module in _MODULES for method in getattr(module, "PUBLISHED", ())
}
"""Methods with the coefficients or in the form that the documents print, to be compared with the others.
They have no error bound for a highlight gate."""

MODELS: dict[str, Specular | Power] = {
    model.name: Specular(model) for model in REFLECTION_MODELS.values() if isinstance(model, Specular.SERVED)
} | {"blinn": Power()}
"""Specular units of the reflection models; every method serves each."""


def preset(
    method: str = "chord",
    model: str | None = "cosquad",
    lights: int = 1,
    *,
    operand: Operand | None = None,
    style: str = "throughput",
    setup_interval: int | None = None,
    exponent: int | None = None,
    **options,
) -> Design:
    """A design by names.

    Parameters
    ----------
    method : str
        One of `METHODS` or `PUBLISHED`.
    model : str or None
        One of `MODELS`; ``None``: no specular light.
    lights : int
        Number of lights, 0 to 16.
    operand : {"cosine", "one_minus_cosine"}, optional
        Operand of the specular unit, of a method that finds normals; by default that of the method.
    style, setup_interval, exponent
        See `Build`.
    **options
        Further fields of `Design`, or of the method; ``None``: its own value.

    Returns
    -------
    Design

    Raises
    ------
    ValueError
        If a name is unknown, the method lacks an option, or `Design` refuses a value.
    """
    if method not in METHODS | PUBLISHED:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, not {method!r}")
    if model is not None and model not in MODELS:
        raise ValueError(f"model must be one of {', '.join(MODELS)}, not {model!r}")
    interpolator = (METHODS | PUBLISHED)[method]
    if operand not in (None, interpolator.operand):
        if not isinstance(interpolator, NormalInterpolator):
            raise ValueError(f"method {method} finds no normals, and gives 1 - cos gamma")
        interpolator = replace(interpolator, operand=operand)
    of_design = {field.name for field in fields(Design)}
    own = {name: options.pop(name) for name in list(options) if name not in of_design}
    own = {name: value for name, value in own.items() if value is not None}
    if unknown := sorted(own.keys() - {field.name for field in fields(interpolator)}):
        raise ValueError(f"method {method} has no option {unknown[0]}")
    build = Build(style, setup_interval, exponent)
    specular = MODELS[model] if model else None
    return Design(replace(interpolator, **own), specular, lights, build=build, **options)
