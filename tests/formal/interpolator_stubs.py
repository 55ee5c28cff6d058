"""Stubs for the parts of interpolators: short units, which pass on words of few bits."""

from amaranth.hdl import Cat, Const, Fragment, Signal, Value

import blysk.hdl.cosines.highlight_cosine
import blysk.hdl.methods.angular_interpolator
import blysk.hdl.methods.bisection_interpolator
import blysk.hdl.methods.chord_spans
import blysk.hdl.methods.interpolator
import blysk.hdl.methods.linear_interpolator
import blysk.hdl.methods.quadratic_interpolator
import blysk.hdl.methods.quotient_interpolator
import blysk.hdl.methods.recurrence_interpolator
import blysk.hdl.methods.renormalise_interpolator
import blysk.hdl.normals.difference_accumulator
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.stream import connect_slice
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.methods.chord_spans import ChordAccumulatorUnit
from blysk.hdl.methods.renormalise_interpolator import LineAccumulatorUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit, DifferenceAccumulatorUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit

from .stubs import short, short_wave

# Spans have 0 to 3 pixels. Setups are built for this interval.
LENGTH_BITS, INTERVAL = 2, 2
TAG_BITS = 2
WORD_BITS = LENGTH_BITS + TAG_BITS
NARROW = DifferenceAccumulator(SQ(1, WORD_BITS), SQ(2, WORD_BITS + 1), SQ(2, WORD_BITS + 1), SQ(1, WORD_BITS))


def word(number: FixedValue) -> Value:
    """The word of a pixel: its position in its span, and the tag of the span."""
    return Value.cast(number)[:WORD_BITS]


def tag(number: FixedValue) -> Value:
    """The tag of a span, from the word of a pixel."""
    return word(number)[LENGTH_BITS:]


def first_word(number: FixedValue, place: int = 0) -> Value:
    """The word of the pixel at a position of the span."""
    return Cat(Const(place, LENGTH_BITS), tag(number))


def put(number: FixedValue, code: Value):
    """Assign a code to a number."""
    return Value.cast(number).eq(code)


def left(span):
    return span.normal_left[0]


def value(span, place=0):
    return span["values"][0].diffuse[place]


def line_start(span):
    return span.line.start[0]


def line_vector(pixel):
    return pixel.vector[0]


def constant_coefficient(span):
    return span.q[0]


def start(span):
    return span.start[0]


def light_start(span):
    return span.start[0].diffuse


def light_difference(span):
    return span.lights[0].diffuse.first


def phase(span):
    return span.phase


def first_value(span, light, copy="diffuse"):
    return span.lights[light][copy].first[0]


def itself(pixel):
    return pixel


def vector_start(span):
    return span.start[0]


def vector_line(pixel):
    return pixel.line[0]


def normal(pixel):
    return pixel[0]


def cosine(pixel):
    return pixel[0].cosine


def difference_setup(span, gives):
    yield put(gives.start[0], first_word(span.q[0]))
    yield gives.length.eq(span.length)


def line_setup(span, gives):
    yield put(gives.start[0], first_word(left(span)))
    yield gives.length.eq(span.length)


def chord_setup(span, gives):
    yield put(light_difference(gives), first_word(value(span)))


def middle_normal(span, gives):
    yield put(gives.normal_left[0], word(span.normal_left[0]))


def coefficients(span, gives):
    yield put(gives.q[0], word(span.normal_left[0]))


def renormaliser(vector, gives):
    yield put(gives.normal[0], word(line_vector(vector)))


def products(vector, gives):
    yield put(gives[0].cosine, word(vector[0]))


def quotients(words, gives):
    yield put(gives.lights[0].cosine, word(vector_line(words)))


def angular_setup(span, gives):
    # The angle falls from pixel to pixel.
    yield put(gives.phase, Cat(Const(3, LENGTH_BITS), tag(left(span))))
    yield put(gives.step, 1)
    yield gives.length.eq(span.length)


def recurrence_setup(span, gives):
    for light in gives.lights:
        for copy in (light.diffuse, light.highlight):
            for place, number in enumerate(copy.first):
                yield put(number, first_word(left(span), place))
    yield gives.length.eq(span.length)


def angle(theta, cos_beta):
    return Cat(~theta[:LENGTH_BITS], theta[LENGTH_BITS:WORD_BITS])


def loop(self, m, name, start, starts, *others):
    """A stub for the recurrence unit. It gives each of a span's first four pixels the value from the span."""
    x = Signal(WORD_BITS, name=name)
    with m.If(starts):
        m.d.sync += x.eq(word(start[0]))
    format = self.model.result_format
    return FixedValue(format, Cat(x, Const(0, format.width - WORD_BITS)))


def walk(find, place):
    """A stub for an accumulator of quadratics. It adds 1 to a word of few bits at each pixel of a span."""

    def quadratics(self, values):
        one, none = (
            FixedValue.constant(NARROW.difference_format, value) for value in (NARROW.result_format.step, 0)
        )
        begin = FixedValue(NARROW.start_format, Cat(first_word(find(self.span)), Const(0, 1)))
        result = FixedValue(NARROW.result_format, Value.cast(place(values))[: WORD_BITS + 1])
        yield "word", NARROW, (begin, one, none), result

    return quadratics


class Line(AccumulatorUnit):
    """A stub for a unit that takes spans and gives normals: an accumulator with the streams of this unit."""

    cycles_per_pixel = 1

    def __init__(self, model):
        unit = self.OF(model)
        # Otherwise the proof would not use the parts of this unit.
        Fragment.get(unit, None)
        super().__init__(unit.i.payload.shape(), unit.o.payload.shape())


class Normaliser(Line):
    """A stub for a span that is not divided. The real unit takes 63 cycles to the first pixel of a span."""

    OF = AdaptiveNormaliserUnit
    quadratics = walk(left, lambda values: values.normal[0])

    def preparation(self, levels):
        return self.latency

    def interval(self, levels):
        return self.latency - 2


class Evaluator(Line):
    """A stub for both forms of the evaluator."""

    OF = QuadraticEvaluatorUnit
    quadratics = walk(constant_coefficient, normal)


class Vectors(Line):
    """Another file proves the setup of this unit."""

    initiation_interval = INTERVAL
    quadratics = walk(vector_start, vector_line)

    def __init__(self, *model, **options):
        self.OF = lambda model: QuotientSpansUnit(*model, **options)
        super().__init__(model)
        self.begun, self.constants = Signal(name="begun"), self.OF(model).constants


def replace_parts(monkeypatch) -> None:
    """Replace parts of interpolators by short units and accumulators of few bits.

    The units take 2 or 3 cycles. All parts pass on words.
    """
    for module, name, hand_on, latency in (
        (blysk.hdl.methods.interpolator, "LightProductsUnit", products, 2),
        (blysk.hdl.methods.linear_interpolator, "DifferenceSetupUnit", difference_setup, 3),
        (blysk.hdl.methods.renormalise_interpolator, "LineSetupUnit", line_setup, 3),
        (blysk.hdl.methods.renormalise_interpolator, "RenormaliserUnit", renormaliser, 2),
        # The length of a span takes three cycles beside these two units.
        (blysk.hdl.methods.quadratic_interpolator, "MiddleNormalUnit", middle_normal, 3),
        (blysk.hdl.methods.quadratic_interpolator, "GPQUnit", coefficients, 1),
        (blysk.hdl.methods.quadratic_interpolator, "DifferenceSetupUnit", difference_setup, 3),
        (blysk.hdl.methods.chord_spans, "ChordSetupUnit", chord_setup, 3),
        (blysk.hdl.methods.angular_interpolator, "AngularSetupUnit", angular_setup, 3),
        (blysk.hdl.methods.recurrence_interpolator, "RecurrenceSetupUnit", recurrence_setup, 3),
        (blysk.hdl.methods.quotient_interpolator, "QuotientUnit", quotients, 3),
    ):
        monkeypatch.setattr(module, name, short(getattr(module, name), hand_on, latency))
    # This FIFO has the same capacity and latency, and other proofs show the same claims of a stream. Proofs
    # with a wide memory take long.
    for module in ("linear", "quadratic", "renormalise"):
        monkeypatch.setattr(
            f"blysk.hdl.methods.{module}_interpolator.connect_wide_fifo",
            lambda m, name, source, sink: connect_slice(m, source, sink),
        )
    monkeypatch.setattr(DifferenceAccumulatorUnit, "quadratics", walk(start, normal))
    monkeypatch.setattr(LineAccumulatorUnit, "quadratics", walk(line_start, line_vector))
    monkeypatch.setattr(ChordAccumulatorUnit, "quadratics", walk(light_start, cosine))
    monkeypatch.setattr(HighlightCosineUnit, "latency", 3)
    monkeypatch.setattr(HighlightCosineUnit, "_wave", short_wave(angle))
    monkeypatch.setattr(RecurrenceUnit, "_reinsch", loop)
    monkeypatch.setattr(blysk.hdl.methods.bisection_interpolator, "AdaptiveNormaliserUnit", Normaliser)
    monkeypatch.setattr(blysk.hdl.methods.quadratic_interpolator, "QuadraticEvaluatorUnit", Evaluator)
    monkeypatch.setattr(blysk.hdl.methods.quotient_interpolator, "QuotientSpansUnit", Vectors)
