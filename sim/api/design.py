"""Designs made from the options of the command line."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, TypeVar, Unpack, cast

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.build import BuildError
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.presets import METHODS, MIRROR_LOBES, PUBLISHED, preset
from blysk.sim.api import costed_design
from blysk.sim.api.options import BUILD, DESIGN, NEEDS, DesignOptions
from blysk.sim.api.settings import Settings, checked, read_settings
from blysk.sim.api.signature import with_options
from blysk.sim.errors import OptionError

__all__ = ["built", "design", "design_of", "refused_counts"]

AnyDesign = TypeVar("AnyDesign", bound=ShadingPipeline)


@with_options({**NEEDS, **DESIGN})
def design(
    *,
    lights: int = 1,
    materials: int = 1,
    factors: int = 0,
    albedo: str | Sequence[str] | None = None,
    grey: bool = False,
    x_bits: int = LENGTH_BITS,
    y_bits: int = LENGTH_BITS,
    length_bits: int = LENGTH_BITS,
    **options: Unpack[DesignOptions],
) -> costed_design.Design:
    """A pipeline with the defaults of the command line.

    Parameters
    ----------
    lights, materials : int
        Numbers of lights and materials that the pipeline serves: 1 to 16 and 1 to 1024.
    factors : int
        Number of lights that fade, by distance or as spots. They are the first lights. Needs ``chord-local``.
    albedo : str or sequence of str, optional
        Colours of pixels: words of `Albedo.PARTS`, see `Albedo.of_parts`. By default there are none.
    grey : bool
        Whether there is one channel in place of three, see `ShadingPipeline`.
    x_bits, y_bits, length_bits : int
        Bits of the coordinates, 1 to 12, and of the length of a span, 2 to 12.
    method : str
        Method of interpolation along a span: one of `METHODS`; by default see `default_method`.
    model : str
        Reflection model: one of `MODELS` or `LOBES`, or the curve of a file; by default ``"blinn"``.
    operand : {"cosine", "one_minus_cosine"}
        Operand of the specular unit, for methods that compute normals.
    gate : bool
        Whether there is a highlight gate.
    setup_interval : int
        Minimum cycles from one span to the next, for methods with this choice.
    style : {"throughput", "compact"}
        ``throughput``: one pixel a cycle. ``compact``: few multipliers.
    transfer : {"srgb", "linear"}
        Codes of the pixels: encoded by the curve of sRGB, or linear light.

    Raises
    ------
    InputError
        If there is no such pipeline.
    """
    words = {"grey": grey, "x_bits": x_bits, "y_bits": y_bits, "length_bits": length_bits}
    needs = {"lights": lights, "materials": materials, "factors": factors, "albedo": albedo, **words}
    settings = read_settings("", {**options, **needs}, {**DESIGN, **NEEDS})
    made = design_of(settings, settings["lights"], settings["materials"])
    made = replace(made, **{name: settings[name] for name in words})
    try:
        made = replace(made, factors=tuple(range(settings["factors"])))
    except ValueError as error:
        remedy = "use chord-local, and at most as many factors as lights"
        raise settings.refuse("factors", str(error), remedy) from None
    if settings["albedo"] is None:
        return made
    try:
        return replace(made, albedo=Albedo.of_parts(settings["albedo"]))
    except ValueError as error:
        reason, _, remedy = str(error).partition("; ")
        remedy = remedy or "leave out tinted, or use a model with a highlight"
        raise settings.refuse("albedo", reason, remedy, ",".join(settings["albedo"])) from None


def design_of(settings: Settings, lights: int, materials: int = 1) -> costed_design.Design:
    """The pipeline that the design options describe.

    Parameters
    ----------
    settings : Settings
        With values of `DESIGN`.
    lights, materials : int
        Numbers of lights and materials.

    Raises
    ------
    OptionError
        If there is no such pipeline.
    """
    method = settings["method"]
    if settings["model"] in MIRROR_LOBES and not (METHODS | PUBLISHED)[method].serves_mirror:
        remedy = (
            "use method quotient; or phong_coplanar, which is exact where N, L and V lie in a plane. On the "
            "default teapot phong_coplanar is 11 LSB of linear light off"
        )
        raise settings.refuse("model", f"method {method} finds N.H, not R.V", remedy)
    if settings["gate"] and not (METHODS | PUBLISHED)[method].serves_gate:
        raise settings.refuse("gate", f"{method} has no error bound for a gate", "leave it out", "")
    options: dict[str, Any] = {name: settings[name] for name in DESIGN if name not in ("method", "model")}
    try:
        made = costed_design.Design.of(preset(method, settings["model"], lights, **options))
    except ValueError as error:
        raise settings.refuse("operand", str(error), "leave it out") from None
    if settings["setup_interval"] is not None:
        _check_interval(settings, made)
    _check_parameter(settings, made)
    if made.loads_tables:
        made = replace(made, specular=replace(made.lobe, banks=min(materials, Lobe.MAX_BANKS)))
    return replace(made, materials=materials)


def _check_interval(settings: Settings, design: ShadingPipeline) -> None:
    """Refuse a setup interval that the method's hardware does not have."""
    # The hardware's description takes a second to import.
    from blysk.hdl.methods.interpolator import spelled
    from blysk.hdl.methods.registry import unit_of

    intervals = unit_of(design.interpolator).setup_intervals(design.interpolator)
    if settings["setup_interval"] not in intervals:
        remedy = f"give {spelled(intervals)}" if intervals else "leave it out"
        raise settings.refuse("setup_interval", f"method {design.method} is not built for it", remedy)


def _check_parameter(settings: Settings, design: ShadingPipeline) -> None:
    """Refuse a caller's roughness or exponent that the reflection model does not take."""
    parameter = design.specular.reflection.PARAMETER if design.specular else None
    for name, used in (("roughness", parameter == "roughness"), ("exponent", parameter is not None)):
        # A scene file's material may have both: it serves several models.
        if name in settings.given and name not in settings.origins and not used:
            remedy = f"leave it out, or give {parameter}" if parameter else "leave it out"
            raise settings.refuse(name, f"the model {design.model} has none", remedy)


def built(design: AnyDesign, given: Mapping[str, Any]) -> AnyDesign:
    """Build a design by options of `BUILD`. Options that are not given keep their values in the design.

    Parameters
    ----------
    design : ShadingPipeline
        The design.
    given : dict
        Values by name, unchecked; ``None`` counts as not given.

    Raises
    ------
    OptionError
        If a value is not accepted, two options exclude each other, or no such core has this design.
    """
    values = checked(given, BUILD)
    geometry = values.pop("geometry", None)
    hardware = geometry == "hardware"
    if geometry is not None:
        values.setdefault("top", "render" if hardware else "shader")
    if hardware and values["top"] == "shader":
        remedy = "leave one of them out"
        raise OptionError("top", "shader", "it takes spans, and hardware geometry takes triangles", remedy)
    if "coarse" in values:
        # Commands that build no geometry start without its files.
        from blysk.golden.geometry.coarse_depth import CoarseDepth

        values["coarse"] = CoarseDepth(*values["coarse"])
    try:
        made = cast(AnyDesign, design.built(**values))
    except BuildError as error:
        raise _refused(error, values) from None
    try:
        PixelPipelines(made)
    except ValueError as error:
        raise OptionError("pipes", made.build.pipes, str(error), "give fewer") from None
    if made.build.takes_triangles:
        from blysk.golden.render import Renderer

        try:
            Renderer(made)
        except BuildError as error:
            raise _refused(error, values) from None
        except ValueError as error:
            option, value = ("geometry", "hardware") if hardware else ("top", made.build.top)
            reason, _, remedy = str(error).partition("; ")
            raise OptionError(option, value, reason, f"{remedy}, or spans from software") from None
    return made


def _refused(error: BuildError, values: Mapping[str, Any]) -> OptionError:
    """The error of a build option, with its value if that says more than that it is given."""
    value = values.get(error.option, "")
    shown = value if isinstance(value, int | str) and value is not True else ""
    return OptionError(error.option, shown, error.reason, error.remedy)


@contextmanager
def refused_counts(design: ShadingPipeline | None) -> Iterator[None]:
    """If the caller's own design refuses a scene, raise an `OptionError` instead."""
    try:
        yield
    except ValueError as error:
        if design is None:
            raise
        raise OptionError(
            "design", "", str(error), "make a design for the scene's lights and materials"
        ) from error
