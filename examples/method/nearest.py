"""The method ``nearest``: each pixel takes the normal of the nearer end of its span."""

from dataclasses import dataclass

import numpy as np
from amaranth.hdl import Const, Mux, Signal, Value
from amaranth.lib import stream

from blysk.bench.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.bench.units.record import Record
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit

__all__ = ["METHODS", "RECORD", "NearestInterpolator", "NearestInterpolatorUnit"]


@dataclass(frozen=True)
class NearestInterpolator(NormalInterpolator):
    """Each pixel takes the normal of the nearer end. Spans are cut to at most 2 degrees.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.
    """

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "nearest"

    @property
    def normal_error(self):
        """0, because the normals are those of the ends."""
        return 0.0

    @property
    def lights_cut(self):
        """``False``: see `cut`."""
        return False

    def widest_span(self, exponent):
        """2 degrees, so that no normal is off by more than 1 degree."""
        return 2.0

    def cut(self, cutter):
        """Spans after cuts by their angle alone."""
        return cutter.by_angle()

    def missed(self, cutter, cut):
        """Number of spans after `cut` whose curve is off by more than a quarter of an LSB."""
        return cutter.missed(cut)

    def operand_error(self, length, degrees):
        """0, because the products are exact."""
        return 0.0

    def normals(self, normal_left, normal_right, length):
        """Bit-accurate normals: of m pixels, the first (m + 1) // 2 have the left normal."""
        span, step = pixels_of(length)
        first = (step < (np.asarray(length) + 1)[span] // 2)[:, np.newaxis]
        codes = np.where(first, normal_left.codes[span], normal_right.codes[span])
        return Fixed(normal_left.format, codes), np.zeros(len(length), dtype=bool)

    def exact_normals(self, normal_left, normal_right, t):
        """The same rule in float64."""
        return np.where(np.asarray(t)[..., np.newaxis] <= 1 / 2, normal_left, normal_right)


METHODS = {NearestInterpolator(): "the normal of the nearer end: flat steps, to show how a method is added"}


class NearestInterpolatorUnit(NormalInterpolatorUnit, model=NearestInterpolator):
    """Two registers for the normals of a span, and a counter; `NearestInterpolator` is the model.

    Parameters
    ----------
    model : NearestInterpolator
        The specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`.
    """

    setup_interval = 1

    def __init__(self, model, lights, **options):
        super().__init__(model, lights, **options)
        self.latency = 1 + self.product_latency

    def source(self, m):
        """The normals, and ``out_of_range``, which is always 0."""
        span, advance = self.i.payload, Signal()
        active, ends = count_down(m, self.i.valid, span.length, advance)
        left, right = (Signal(normal_shape(), name=name) for name in ("left", "right"))
        pixel, half = (Signal(len(span.length), name=name) for name in ("pixel", "half"))
        m.d.comb += self.i.ready.eq(advance & ends)
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [left.eq(span.normal_left), right.eq(span.normal_right)]
            m.d.sync += [pixel.eq(0), half.eq((span.length + 1) >> 1)]
        with m.Elif(advance):
            m.d.sync += pixel.eq(pixel + 1)
        normals = stream.Signature(normal_shape()).create(path=("normals",))
        normal = Mux(pixel < half, Value.cast(left), Value.cast(right))
        m.d.comb += advance.eq(skid_buffer(m, normals, active, normal))
        return normals, Const(0)


RECORD = Record(
    name="nearest",
    title="Normals of the nearer end",
    source="examples/method/nearest.py",
    variants={
        "nearest": measured(NearestInterpolator()),
        "nearest, of a chord": options(NearestInterpolator("one_minus_cosine"), 2, length_bits=9),
    },
    expect=expect,
    status=status,
    stimuli=STIMULI,
)
