"""Designs by name: the methods and reflection models of the command line, the API and the tables."""

from dataclasses import fields, replace
from types import ModuleType
from typing import Any, cast

from blysk.golden.build import Build, Style
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods import (
    angular_interpolator,
    bisection_interpolator,
    linear_interpolator,
    local_chord_interpolator,
    quadratic_interpolator,
    quotient_interpolator,
    recurrence_interpolator,
    renormalise_interpolator,
)
from blysk.golden.methods.installed import load_methods
from blysk.golden.methods.interpolator import Interpolator, Operand
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.lobes import BECKMANN, COPLANAR_PHONG, GGX
from blysk.golden.reference.reflection import BLINN, PHONG, REFLECTION_MODELS, ReflectionModel

__all__ = [
    "LOBES",
    "METHODS",
    "METHOD_LINES",
    "MIRROR_LOBES",
    "MODELS",
    "MODEL_LINES",
    "PUBLISHED",
    "default_method",
    "preset",
]


def _lines(module: ModuleType, *names: str) -> dict[Interpolator, str]:
    """Methods of a module, with a line about each, from its dictionaries with these names."""
    return {method: line for name in names for method, line in vars(module).get(name, {}).items()}


_BUILT_IN = (
    linear_interpolator,
    renormalise_interpolator,
    bisection_interpolator,
    quadratic_interpolator,
    angular_interpolator,
    recurrence_interpolator,
    local_chord_interpolator,
    quotient_interpolator,
)
"""Modules of this project, in the order in which tables list their methods. Each has a dictionary
``METHODS``, and some have ``PUBLISHED``.
"""

_MODULES = (
    *_BUILT_IN,
    *load_methods(method.name for module in _BUILT_IN for method in _lines(module, "METHODS", "PUBLISHED")),
)

METHODS: dict[str, Interpolator] = {
    method.name: method for module in _MODULES for method in _lines(module, "METHODS")
}
"""Interpolation methods by name."""

PUBLISHED: dict[str, Interpolator] = {
    method.name: method for module in _MODULES for method in _lines(module, "PUBLISHED")
}
"""Methods as published, by name: with the coefficients or in the form of the documents, for comparison.
They have no error bound for a highlight gate."""

METHOD_LINES: dict[str, str] = {
    method.name: line
    for name in ("METHODS", "PUBLISHED")
    for module in _MODULES
    for method, line in _lines(module, name).items()
}
"""A line about each method, also about methods as published, for the help of the command line."""

MODELS: dict[str, Specular | Power] = {
    model.name: Specular(model) for model in REFLECTION_MODELS.values() if isinstance(model, Specular.SERVED)
} | {"blinn_product": Power()}
"""Specular units of the reflection models, by name; every method serves each."""

LOBES: dict[str, Lobe] = {
    lobe.name: lobe
    for lobe in (
        Lobe(BLINN),
        # At exponent 1 the lobe reaches 0 with a kink at u = 0.293. With 64 steps an octave a step there is
        # 1/256 wide. The kink falls almost on the start of a step, where it makes little error.
        Lobe(COPLANAR_PHONG, octaves=10, steps=64),
        Lobe(BECKMANN),
        Lobe(GGX),
    )
}
"""Specular units with a table that is written for each frame, by name; every method serves each. A table has
704 words for ``phong_coplanar``, 336 for the other models. At any exponent its largest error found is 0.06
LSB against its model; for roughness see `Lobe`.
"""

MIRROR_LOBES: dict[str, Lobe] = {PHONG.name: QuotientLobe(PHONG)}
"""Specular units of models of R·V, by name; the method ``quotient`` serves each."""

MODEL_LINES: dict[str, str] = {
    **{lobe.name: f"{lobe.reflection.summary}, from a table" for lobe in LOBES.values()},
    **{name: unit.reflection.summary for name, unit in MODELS.items()},
    "blinn_product": f"{BLINN.summary}, by repeated squaring",
    PHONG.name: f"{PHONG.summary}, from a table; needs the method quotient",
}
"""A line about each reflection model, for the help of the command line."""


def default_method(
    model: str | ReflectionModel | None = "blinn",
    gate: bool = False,
    operand: Operand | None = None,
    setup_interval: int | None = None,
    local: bool = False,
) -> str:
    """The method of a design that names none.

    The default is ``quotient``, which models of R·V need. Point lights and a near viewer get ``chord-local``,
    the only method that serves them. Three options, which ``quotient`` lacks, get ``renormalise``, the most
    exact method of normals:

    - a model of `MODELS`, which has a unit of its own in place of a table;
    - an operand;
    - a setup interval.

    A gate gets ``quadratic``, because ``renormalise`` has no bound for a highlight gate. No other
    method of the documents is more exact than ``quadratic``, or takes fewer cycles than it.

    Parameters
    ----------
    model, gate, operand, setup_interval
        As for `preset`.
    local : bool
        Whether a light has a position, or the viewer is near.
    """
    if model in MIRROR_LOBES:
        return "quotient"
    if local:
        return "chord-local"
    if gate:
        return "quadratic"
    return "renormalise" if model in MODELS or operand or setup_interval else "quotient"


def preset(
    method: str | None = None,
    model: str | ReflectionModel | None = "blinn",
    lights: int = 1,
    *,
    operand: Operand | None = None,
    style: Style = "throughput",
    setup_interval: int | None = None,
    exponent: int | None = None,
    roughness: float | None = None,
    **options: Any,
) -> ShadingPipeline:
    """Make a design by names.

    Parameters
    ----------
    method : str, optional
        One of `METHODS` or `PUBLISHED`; by default `default_method`.
    model : str or ReflectionModel or None
        One of `MODELS` or `LOBES`, and for the method ``quotient`` also one of `MIRROR_LOBES`. Or a
        reflection model of N·H, such as a `TabulatedModel`; the design then has a table. ``None``: no
        specular light.
    lights : int
        Number of lights, 0 to 16.
    operand : {"cosine", "one_minus_cosine"}, optional
        Operand of the specular unit, for a method that finds normals; by default the operand of the method.
    style, setup_interval
        See `Build`.
    exponent, roughness : optional
        Parameter fixed at build time: `Build.exponent`, or the parameter of a lobe's table (`Lobe.fixed`).
    **options
        Further fields of `ShadingPipeline`, of the lobe, or of the method; ``None``: the default. A lobe has
        as many ``banks`` as there are materials, at most `Lobe.MAX_BANKS`.

    Returns
    -------
    ShadingPipeline

    Raises
    ------
    ValueError
        If a name is unknown, the method lacks an option, or `ShadingPipeline` refuses a value.
    """
    if method is None:
        method = default_method(model, options.get("gate", False), operand, setup_interval)
    if method not in METHODS | PUBLISHED:
        raise ValueError(f"method must be one of {', '.join(METHODS | PUBLISHED)}, not {method!r}")
    specular = _specular(model)
    interpolator = (METHODS | PUBLISHED)[method]
    if operand not in (None, interpolator.operand):
        interpolator = interpolator.with_operand(operand)
    of_design = {field.name for field in fields(ShadingPipeline)}
    own = {name: options.pop(name) for name in list(options) if name not in of_design}
    own = {name: value for name, value in own.items() if value is not None}
    if specular is not None and specular.has_table:
        given = {name: own.pop(name) for name in ("octaves", "steps", "banks", "cutoff") if name in own}
        given.setdefault("banks", min(options.get("materials", 1), Lobe.MAX_BANKS))
        specular = _with_fixed_table(replace(cast(Lobe, specular), **given), exponent, roughness)
        exponent = None
    elif roughness is not None:
        raise ValueError(f"model {model} has no roughness to fix")
    if unknown := sorted(own.keys() - {field.name for field in fields(interpolator)}):
        raise ValueError(f"method {method} has no option {unknown[0]}")
    build = Build(style, setup_interval, exponent)
    return ShadingPipeline(replace(interpolator, **own), specular, lights, build=build, **options)


def _specular(model: str | ReflectionModel | None) -> Specular | Power | Lobe | None:
    if model is None:
        return None
    if isinstance(model, ReflectionModel):
        return Lobe(model)
    known = MODELS | LOBES | MIRROR_LOBES
    if model not in known:
        raise ValueError(f"model must be one of {', '.join(known)}, not {model!r}")
    return known[model]


def _with_fixed_table(lobe: Lobe, exponent: int | None, roughness: float | None) -> Lobe:
    """The lobe with a table fixed at build time for the exponent or roughness, if one is given."""
    for name, value in (("exponent", exponent), ("roughness", roughness)):
        if value is not None and name != lobe.reflection.PARAMETER:
            raise ValueError(f"model {lobe.name} has no {name} to fix")
        if value is not None:
            lobe = replace(lobe, fixed=(value,), banks=1)
    return lobe
