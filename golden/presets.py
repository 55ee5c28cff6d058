"""Designs by name: the methods and reflection models of the command line, the API and the tables."""

from dataclasses import replace

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import Interpolator, NormalInterpolator, Operand
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.pipeline import Build, Design
from blysk.golden.reference.reflection import REFLECTION_MODELS

__all__ = ["METHODS", "MODELS", "PUBLISHED", "preset"]

METHODS: dict[str, Interpolator] = {
    method.name: method
    for method in (
        LinearInterpolator(),
        BisectionInterpolator(),
        QuadraticInterpolator(),
        QuadraticInterpolator(form="direct"),
        QuadraticInterpolator(form="horner"),
        AngularInterpolator(),
        RecurrenceInterpolator(),
        LinearInterpolator(renormalised=True),
        ChordInterpolator(),
        LocalChordInterpolator(),
    )
}
"""Interpolation methods."""

PUBLISHED: dict[str, Interpolator] = {
    method.name: method
    for method in (
        BisectionInterpolator(bisection=Bisection(as_published=True)),
        QuadraticInterpolator(middle_normal=MiddleNormal("as_published")),
        AngularInterpolator(AngularSetup("arccos", Arccos("as_published"))),
        AngularInterpolator(AngularSetup("arccos", Arccos("corrected"))),
        RecurrenceInterpolator("direct"),
    )
}
"""Methods with the coefficients or in the form that the documents print, to be compared with the others: the
polynomials of [T] 2.1 and 2.2, table 3.1 with its misprint and without, and formula 3.3 as it stands. A
gate does not go with them."""

MODELS: dict[str, Specular | Power] = {
    model.name: Specular(model) for model in REFLECTION_MODELS.values() if isinstance(model, Specular.SERVED)
} | {"blinn": Power()}
"""Units of the reflection models; every method serves each."""


def preset(
    method: str = "quadratic",
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
        What the specular unit is given, of a method that finds normals; by default what the method gives.
    style, setup_interval, exponent
        See `Build`.
    **options
        Further fields of `Design`, or of the method.

    Returns
    -------
    Design

    Raises
    ------
    ValueError
        If a name is unknown, a method has no choice of operand, or `Design` refuses a value.
    """
    if method not in METHODS | PUBLISHED:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, not {method!r}")
    if model is not None and model not in MODELS:
        raise ValueError(f"model must be one of {', '.join(MODELS)}, not {model!r}")
    interpolator = (METHODS | PUBLISHED)[method]
    own = {name: options.pop(name) for name in ("terms", "fraction_bits") if options.get(name) is not None}
    if own and not isinstance(interpolator, ChordInterpolator):
        raise ValueError(f"terms and fraction_bits are for the method chord, not {method}")
    if operand not in (None, interpolator.operand):
        if not isinstance(interpolator, NormalInterpolator):
            raise ValueError(f"method {method} finds no normals, and gives 1 - cos gamma")
        own["operand"] = operand
    interpolator = replace(interpolator, **own)
    build = Build(style, setup_interval, exponent)
    return Design(interpolator, MODELS[model] if model else None, lights, build=build, **options)
