"""Interpolators: units that turn a span into the operands of its pixels, by any method."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from amaranth.hdl import Module, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.beats import Spans
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.methods.light_products import LightProductsUnit, operands_shape

__all__ = ["InterpolatorUnit", "NormalInterpolatorUnit", "flag_spans", "span_words", "spelled"]


def spelled(numbers: Sequence[int]) -> str:
    """Numbers in ascending order in words: ``1 to 6``, or ``3, 9 or 18``."""
    if len(numbers) > 1 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"{numbers[0]} to {numbers[-1]}"
    *others, last = map(str, numbers)
    return f"{', '.join(others)} or {last}" if others else last


def span_words(span: data.View) -> list[tuple[str, Value]]:
    """Names and values of a span's members. A shorter length may be assigned to a length of 12 bits."""
    return [(name, span[name]) for name in ("normal_left", "normal_right", "length")]


def flag_spans(m: Module, accepted: Value, pixel: data.View) -> Signal:
    """Flag each span once, at its first pixel that is out of range.

    Parameters
    ----------
    m : Module
        Module that gets the registers.
    accepted : Value
        Whether a pixel leaves on this cycle.
    pixel : data.View
        The pixel, with ``out_of_range`` and ``span``. ``span`` is a bit that alternates from span to span.

    Returns
    -------
    Signal
        High for a cycle for each flagged span.
    """
    last, flagged, out_of_range = (Signal(name=name) for name in ("last", "flagged", "out_of_range"))
    before = flagged & (last == pixel.span)
    m.d.sync += out_of_range.eq(0)
    with m.If(accepted):
        m.d.sync += [
            out_of_range.eq(pixel.out_of_range & ~before),
            flagged.eq(pixel.out_of_range | before),
            last.eq(pixel.span),
        ]
    return out_of_range


class InterpolatorUnit(wiring.Component):
    """A method of the pipeline. It turns spans into the operands of their pixels, first pixel first.

    Each method has a subclass, which names the class of its bit-accurate model::

        class LinearInterpolatorUnit(NormalInterpolatorUnit, model=LinearInterpolator):

    and sets three attributes: `latency`, the cycles from a span to its first pixel without stalls;
    `setup_interval`, the least cycles from a span to the next; and `cycles_per_pixel`.

    Parameters
    ----------
    model : Interpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    setup_interval : int or None
        Least cycles from a span to the next, one of `setup_intervals`. ``None``: the largest interval up to
        `DEFAULT_INTERVAL`, or the only interval of a method without a choice.
    highlights : bool
        Whether there is specular light, and operands for it.
    length_bits : int
        Bits of the length.
    product_interval : int
        Least cycles from a pixel to the next in the products with L and H, for methods that find normals.
    factors : sequence of int
        Indices of the lights that fade, for methods that serve them, see `ShadingPipeline`.
    lanes : int
        Pixels of a beat. With several lanes ``o`` has an array of operands, an entry for each lane. They are
        operands of neighbouring pixels of a span. At the end of a span, entries without a pixel have no
        meaning.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape(lights, highlights=highlights, length_bits=length_bits)))`
        Spans of length 1 or more.
    o : :py:`Out(stream.Signature(operands_shape(model, lights, highlights=highlights)))`
        Operands of the pixels.
    constants : :py:`In(light_vectors_shape(lights))`
        L and H of each light, constant while spans are inside. See `constant_members`.
    out_of_range : :py:`Out(1)`
        High for one cycle for each span with a larger angle than the method serves.

    Raises
    ------
    ValueError
        If the method cannot be built for the setup interval.
    """

    UNITS: ClassVar[dict[type[Interpolator], type["InterpolatorUnit"]]] = {}
    """Unit of each method, by the class of its model. `registry` fills it."""

    cycles_per_pixel = 1

    room_after = 2
    """Least cycles from a span's first pixel until the second span after it is prepared."""

    DEFAULT_INTERVAL = 4
    """Largest default of `setup_interval`."""

    def __init_subclass__(cls, *, model: type[Interpolator] | None = None, **options):
        super().__init_subclass__(**options)
        if model is not None:
            InterpolatorUnit.UNITS[model] = cls

    @classmethod
    def setup_intervals(cls, model: Interpolator) -> Sequence[int]:
        """Setup intervals that the method can be built for; empty without a choice."""
        return ()

    @classmethod
    def gate(cls, design: ShadingPipeline, setup_interval: int) -> PipelinedUnit:
        """The gate that decides beside this unit, from the same spans.

        Parameters
        ----------
        design : ShadingPipeline
            A design with a gate.
        setup_interval : int
            Cycles from a span to the next in this unit. The gate takes spans as often.
        """
        return HighlightGateUnit(
            design.highlight_gate,
            design.lights,
            initiation_interval=min(setup_interval, 3 + 12 * design.lights),
            exponent=design.build.exponent,
            takes_threshold=design.has_threshold,
        )

    @property
    def shortest_interval(self) -> int:
        """Least cycles from any span to the next. A short span may take fewer than `setup_interval`."""
        return self.setup_interval

    def span_intervals(self, spans: Spans) -> np.ndarray:
        """Least cycles from the previous span to each span, without stalls; int array, shape (spans,)."""
        return np.full(len(spans), self.setup_interval)

    @property
    def has_begun(self) -> Value | None:
        """Whether some words of the offered span were taken already. Payload and constants then have to stay.

        ``None`` if a unit takes all words of a span at once.
        """
        return None

    def constant_members(self) -> dict[str, wiring.Member]:
        """Ports for the constants that the method reads, by default L and H of each light."""
        return {"constants": In(light_vectors_shape(self.lights))}

    def further_members(self) -> dict[str, wiring.Member]:
        """Further ports of a method."""
        return {}

    @property
    def light_vectors(self) -> data.View | tuple:
        """Ports for L and H of each light; empty for a method that does not read them."""
        return self.constants

    @classmethod
    def span_shape(cls, lights: int, *, highlights: bool = True, length_bits: int = LENGTH_BITS):
        """Shape of a span.

        Parameters
        ----------
        lights, highlights, length_bits
            As for the unit.
        """
        return span_normals_shape(length_bits)

    @classmethod
    def span_options(cls, model: Interpolator) -> dict[str, bool]:
        """Further arguments of `span_shape` that follow from the model; empty by default."""
        return {}

    def __init__(
        self,
        model: Interpolator,
        lights: int,
        *,
        setup_interval: int | None = None,
        highlights: bool = True,
        length_bits: int = LENGTH_BITS,
        product_interval: int = 1,
        factors: Sequence[int] = (),
        lanes: int = 1,
    ):
        intervals = self.setup_intervals(model)
        if setup_interval not in (None, *intervals):
            choice = spelled(intervals) if intervals else "left out"
            raise ValueError(f"setup_interval of {model.name} must be {choice}, not {setup_interval}")
        if intervals:
            most = self.DEFAULT_INTERVAL
            self.setup_interval = setup_interval or max(
                interval for interval in intervals if interval <= most
            )
        self.model = model
        self.lights = lights
        self.highlights = highlights
        self.length_bits = length_bits
        self.product_interval = product_interval
        self.factors = tuple(factors)
        self.lanes = lanes
        further = {"factors": len(factors)} if factors else {}
        further |= self.span_options(model)
        span = self.span_shape(lights, highlights=highlights, length_bits=length_bits, **further)
        operands = operands_shape(model, lights, highlights=highlights, factored=bool(factors))
        if lanes > 1:
            operands = data.ArrayLayout(operands, lanes)
        members = {
            "i": In(stream.Signature(span)),
            "o": Out(stream.Signature(operands)),
            "out_of_range": Out(1),
        }
        super().__init__(members | self.constant_members() | self.further_members())


class NormalInterpolatorUnit(InterpolatorUnit):
    """A method that finds a normal for each pixel, and its products with L and H of every light.

    A subclass describes the part from spans to normals in `source`, and sets `latency`, which includes
    `product_latency`. The products have ``ceil(6 lights / product_interval)`` multipliers, half as many
    without highlights.
    """

    def __init__(self, model: NormalInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._products = LightProductsUnit(
            model, lights, highlights=self.highlights, initiation_interval=self.product_interval
        )
        self.product_latency = self._products.latency
        self.cycles_per_pixel = max(self.cycles_per_pixel, self.product_interval)

    def source(self, m: Module) -> tuple[stream.Interface, Value]:
        """Describe in ``m`` the part from spans to normals.

        Returns the stream of normals, and ``out_of_range``.
        """
        raise NotImplementedError

    def elaborate(self, platform):
        """Normals, then products."""
        m = Module()
        normals, out_of_range = self.source(m)
        m.submodules.products = products = self._products
        connect(m, normals, products.i)
        connect(m, products.o, wiring.flipped(self.o))
        m.d.comb += [copy(products.constants, self.constants), self.out_of_range.eq(out_of_range)]
        return m
