"""The pipeline with internal values in its status: the number of gated pixels, and words of its stages."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from amaranth.hdl import Fragment, Module, Shape, ShapeLike, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.wiring import Component, In, Out

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import Format
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.views import copy
from blysk.hdl.pipeline import ShadingPipelineUnit

__all__ = ["ObservedPipeline", "Probe", "probes_of"]

_GATED_BITS = 32


@dataclass(frozen=True)
class Probe:
    """A watched word of the pipeline.

    Parameters
    ----------
    name : str
        Name of the word.
    title : str
        Short description of the word for a reader.
    block : str
        Part of the pipeline that has the word: ``interpolator``, ``gate``, ``diffuse``, ``specular``,
        ``intensity`` or ``output``.
    shape : ShapeLike
        Its shape. A fixed-point number has a `FixedShape`.
    age : int
        Cycles from the cycle in which the lights take a pixel's operands (``taken`` of `ObservedPipeline`) to
        the cycle in which the word belongs to this pixel. Negative if the word comes first. If terms wait for
        their albedo, words from the terms on are later. Until a pixel is held they keep their distance from
        ``shaded``.
    exact : str
        Name of the exact quantity that the word approximates: ``normal_x``, ``normal_y``, ``normal_z``;
        ``cosine`` (N·L), ``highlight_cosine`` (N·H), ``one_minus_cosine`` (1 - N·H); ``product`` (the
        specular unit's slope k times 1 - N·H), ``base``, ``base_2``, ``base_4``, ``base_8`` (powers of the
        base); ``diffuse``, ``specular``; ``albedo`` of red; ``red_diffuse``, ``red_specular``,
        ``red_surface`` (the light that the albedo multiplies), ``red`` in LSB, not limited; ``r``, ``g``,
        ``b`` in LSB, limited. Empty for flags, columns, the increments of a sum, and a place in a lobe's
        table.
    unit : float
        Value of the word that stands for 1 of the exact quantity.
    """

    name: str
    title: str
    block: str
    shape: ShapeLike
    age: int
    exact: str
    unit: float = 1.0


class ObservedPipeline(Component):
    """A pipeline of one light with internal values in its status. They change no beat.

    Parameters
    ----------
    design : ShadingPipeline
        Design of the pipeline, with one light. It may have a gate, or an albedo with texels inside.

    Members
    -------
    i, o, write
        As for `ShadingPipelineUnit`.
    status : :py:`Out(StructLayout({..., "gated_pixels": 32}))`
        The fields of its status, and

        - ``gated_pixels``: number of taken pixels whose spans have no highlight, as the gate decides; 0
          without a gate;
        - ``waits``: whether a pixel of the interpolator is stalled;
        - ``taken``: whether the lights take a pixel;
        - ``shaded``: whether the intensity unit takes the terms of a pixel, and its albedo;
        - ``held``: whether a pixel of the intensity unit is stalled;
        - each word, by the name of its probe.

    Raises
    ------
    ValueError
        If the design does not have exactly one light.
    """

    def __init__(self, design: ShadingPipeline):
        if design.lights != 1:
            raise ValueError("only a pipeline with one light can be observed")
        self.design = design
        self.unit = ShadingPipelineUnit(design)
        members = dict(self.unit.signature.members)
        status = members.pop("status").shape.members
        status |= {"gated_pixels": unsigned(_GATED_BITS), "waits": unsigned(1)}
        status |= dict.fromkeys(("taken", "shaded", "held"), unsigned(1))
        status |= {probe.name: probe.shape for probe in probes_of(self.unit)}
        super().__init__(members | {"status": Out(data.StructLayout(status))})

    def elaborate(self, platform):
        """The pipeline, the counter of gated pixels, and connections from internal words to the status."""
        m = Module()
        # The unit is elaborated here, so that its internal signals can be found.
        m.submodules.pipeline = fragment = Fragment.get(self.unit, platform)
        for name, member in self.unit.signature.members.items():
            inner, outer = getattr(self.unit, name), getattr(self, name)
            if name == "status":
                m.d.comb += [outer[field].eq(inner[field]) for field in inner.shape().members]
                continue
            source, sink = (outer, inner) if member.flow == In else (inner, outer)
            m.d.comb += [
                copy(sink.payload, source.payload),
                sink.valid.eq(source.valid),
                source.ready.eq(sink.ready),
            ]
        gated = Signal(_GATED_BITS)
        operands, taken = _unit(fragment, "interpolator").o, _unit(fragment, "light_0").i
        shaded, held = (getattr(_unit(fragment, "intensity"), port) for port in "io")
        m.d.comb += [
            self.status.gated_pixels.eq(gated),
            self.status.waits.eq(operands.valid & ~operands.ready),
            self.status.taken.eq(taken.valid & taken.ready),
            self.status.shaded.eq(shaded.valid & shaded.ready),
            self.status.held.eq(held.valid & ~held.ready),
        ]
        if self.design.gate:
            m.d.sync += gated.eq(gated + (taken.valid & taken.ready & taken.payload.gated))
        for probe, value in _words(self.unit, fragment):
            m.d.comb += copy(self.status[probe.name], value)
        return m


def probes_of(unit: ShadingPipelineUnit) -> list[Probe]:
    """Watched words of a pipeline of one light, from the interpolator to the output.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline.
    """
    return [probe for probe, _ in _words(unit, Fragment.get(unit, None))]


def _part(fragment: Fragment, path: str) -> Fragment | None:
    """Submodule by its path: names with dots between them. ``None`` if no submodule has this path."""
    for name in path.split("."):
        inside = [part for part, own, *_ in fragment.subfragments if own == name]
        if not inside:
            return None
        fragment = inside[0]
    return fragment


def _unit(fragment: Fragment, path: str) -> Component | None:
    part = _part(fragment, path)
    return part and part.origins[0]


def _registers(fragment: Fragment | None) -> dict[str, Signal]:
    if fragment is None:
        return {}
    clocked = (statements for domain, statements in fragment.statements.items() if domain != "comb")
    return {signal.name: signal for statements in clocked for signal in statements._lhs_signals()}


def _assignments(statements) -> Iterator[tuple[Iterable[Signal], Iterable[Signal]]]:
    """Signals written and signals read by each assignment, also under conditions. Conditions are ignored."""
    for statement in statements:
        if hasattr(statement, "cases"):
            for _, inner, *_ in statement.cases:
                yield from _assignments(inner)
        else:
            yield statement.lhs._lhs_signals(), statement.rhs._rhs_signals()


def _ages(fragment: Fragment, operands: Value) -> dict[str, int]:
    """Latency in cycles from the operands to each register of a data path without feedback, by name.

    Registers that do not depend on the operands are left out.
    """
    # By `id`, as signals of Amaranth cannot be keys of a dictionary.
    registers = _registers(fragment)
    clocked = {id(signal) for signal in registers.values()}
    sources: dict[int, list[Signal]] = defaultdict(list)
    for statements in fragment.statements.values():
        for targets, from_ in _assignments(statements):
            for target in targets:
                sources[id(target)] += from_
    ages: dict[int, int | None] = {id(signal): 0 for signal in Value.cast(operands)._rhs_signals()}

    def age(signal: Signal) -> int | None:
        key = id(signal)
        if key not in ages:
            ages[key] = None
            before = [known for source in sources[key] if (known := age(source)) is not None]
            ages[key] = max(before) + (key in clocked) if before else None
        return ages[key]

    return {name: found for name, signal in registers.items() if (found := age(signal)) is not None}


_SPECULAR_WORDS = {
    "argument": ("1 − N·H, limited", "one_minus_cosine", float(ONE_SQUARED.values)),
    "product": ("slope times 1 − N·H", "product", 1.0),
    "base": ("base", "base", 1.0),
    **{
        name: (f"base to the power {power}", f"base_{power}", 1.0)
        for name, power in (("square", 2), ("square_2", 4), ("square_3", 8))
    },
}
"""Title, exact value and scale of words of a specular unit, by `HighlightOperand.word_formats`."""


def _words(unit: ShadingPipelineUnit, fragment: Fragment) -> Iterator[tuple[Probe, Value]]:
    """Each probe and the value that it watches."""
    design = unit.model

    def number(name, title, block, value, age, exact, scale=1.0, format: Format | None = None):
        if format is not None:
            value = FixedValue(format, value)
        return Probe(name, title, block, value.shape(), age, exact, scale), value

    one, one_squared = COMPONENT.max_code * COMPONENT.step, float(ONE_SQUARED.values)
    yield from _accumulators(fragment, number, one)

    interpolator, light = _unit(fragment, "interpolator"), _unit(fragment, "light_0")
    operands = interpolator.o.payload[0]
    yield number("cosine", "N·L", "interpolator", operands.cosine, 0, "cosine", one_squared)
    title, exact = {
        "cosine": ("N·H", "highlight_cosine"),
        "one_minus_cosine": ("1 − N·H", "one_minus_cosine"),
        "place": ("place in the table", ""),
    }[design.interpolator.operand]
    yield number("highlight", title, "interpolator", operands.highlight, 0, exact, one_squared)
    if design.gate:
        gated = light.i.payload.gated
        yield Probe("gated", "gate: no highlight", "gate", Shape.cast(gated.shape()), 0, ""), gated

    datapath = _part(fragment, "light_0.specular.datapath")
    words = _registers(datapath)
    ages = _ages(datapath, _unit(fragment, "light_0.specular").i.payload)
    for name, format in design.specular.word_formats.items() if design.specular else ():
        title, exact, scale = _SPECULAR_WORDS[name]
        if name in ages and len(words[name]) == format.width:
            yield number(name, title, "specular", words[name], ages[name], exact, scale, format)
    terms = light.o.payload
    yield number("diffuse", "diffuse term", "diffuse", terms.diffuse, light.latency, "diffuse")
    yield number("specular", "specular term", "specular", terms.specular, light.latency, "specular")

    datapath, intensity = _part(fragment, "intensity.datapath"), _unit(fragment, "intensity")
    words, ages = _registers(datapath), _ages(datapath, intensity.i.payload)
    if design.albedo is not None:
        red = intensity.i.payload.albedo[0]
        yield number("albedo", "albedo, red", "intensity", red, light.latency, "albedo")
    for name, own, title, format in _sums_of_red(design):
        age = light.latency + ages[own]
        yield number(name, title, "intensity", words[own], age, name, format=format)
    ends = (
        ("intensity", "pixel_assembler")
        if design.transfer == "linear"
        else ("intensity", "transfer", "pixel_assembler")
    )
    age = light.latency + sum(_unit(fragment, name).latency for name in ends)
    pixel = unit.o.payload
    for name, title in (("r", "red"), ("g", "green"), ("b", "blue")):
        value = pixel[name]
        yield Probe(name, title, "output", Shape.cast(value.shape()), age, name), value
    for name, title in (("x", "column"), ("last", "last of its span")):
        value = pixel[name]
        yield Probe(name, title, "output", Shape.cast(value.shape()), age, ""), value


def _sums_of_red(design: ShadingPipeline) -> Iterator[tuple[str, str, str, Format]]:
    """Words of red in the intensity unit: name, name of its register, title, format."""
    product = Intensity.COLOR_FORMAT * Intensity.TERM_FORMAT
    yield "red_diffuse", "diffuse_0_r", "red, diffuse", product
    yield "red_specular", "specular_0_r", "red, specular", product
    if design.albedo is None:
        total = product + product
        yield "red", "sum_1_0_r", "red, all light", total + total
    else:
        surface = Intensity.SURFACE_FORMAT
        total = surface * Intensity.ALBEDO_FORMAT + (product + Intensity.COLOR_FORMAT)
        yield "red_surface", "surface_r", "red, light on the surface", surface
        yield "red", "sum_r", "red, all light", total


def _accumulators(fragment, number, one: float):
    """Probes for the sums of methods with an accumulator of normals, and for the increments of the sums."""
    words = _registers(_part(fragment, "interpolator.difference_accumulator"))
    if words:
        age = -1 - _unit(fragment, "interpolator").product_latency
        for c, axis in enumerate("xyz"):
            formats, title = DifferenceAccumulator(), f"sum for N, {axis}"
            yield from _sums(number, words, f"normal_{c}", title, f"normal_{axis}", formats, age, one)


def _sums(number, words, own, title, exact, formats: DifferenceAccumulator, age: int, unit: float):
    yield number(f"{own}_sum", title, "interpolator", words[own], age, exact, unit, formats.format)
    step = words[f"{own}_difference"]
    title = f"{title}: added next"
    yield number(f"{own}_step", title, "interpolator", step, age, "", unit, formats.difference_format)
