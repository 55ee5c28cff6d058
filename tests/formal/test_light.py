"""Proofs of the light unit: dark beats that pass the specular unit by keep their places."""

import pytest
from amaranth.hdl import Cat, Const, Mux, Value

import hdl.light
from golden.diffuse import Diffuse
from hdl.fixed import FixedShape
from hdl.light import LightUnit
from hdl.specular import highlight_shape
from hdl.stream import PipelinedUnit

from .prover import Harness
from .rules import answers, follows, stays, taken

pytestmark = pytest.mark.prove


class Tag(PipelinedUnit):
    """In the specular unit's place: two bits of the operand, a clock after the interval."""

    def __init__(self, parameters, initiation_interval, **options):
        super().__init__(
            highlight_shape(parameters),
            FixedShape(parameters.RESULT_FORMAT),
            latency=initiation_interval + 1,
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        value = Value.cast(operands.operand)[:2]
        value = self.register(m, value, "late", when=self.at(1))
        for stage in range(self.latency - 2):
            value = self.register(m, value, f"stage_{stage}")
        return Cat(value, Const(0, len(Value.cast(self.o.payload)) - 2))


@pytest.fixture(autouse=True)
def tags(monkeypatch):
    """Light units have tags for specular terms."""
    monkeypatch.setattr(hdl.light, "SpecularUnit", Tag)


def of_light(interval):
    """Beats of one bit of N.L, its sign, and two of the specular operand."""
    unit = LightUnit(initiation_interval=interval)
    h = Harness(unit)
    cosine, highlight = (Value.cast(unit.i.payload[name]) for name in ("cosine", "highlight"))
    step = unit.i.payload.cosine.format.fraction_bits - Diffuse.RESULT_FORMAT.fraction_bits
    h.assume((cosine[:step] == 0) & (cosine[step + 1 : -1] == 0) & (highlight[2:] == 0))

    def image(came, leaves):
        cosine, highlight = Value.cast(came.cosine), Value.cast(came.highlight)
        lit = ~cosine[-1] & cosine.any()
        diffuse = Value.cast(leaves.diffuse) == Mux(cosine[-1], 0, cosine[step])
        return diffuse & (Value.cast(leaves.specular) == Mux(lit, highlight[:2], 0))

    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, 5, image)
    answers(h, inside.any(), taken(unit.o), interval + 3, unit.o.ready)
    return h


@pytest.mark.parametrize("interval", [2, 3])
def test_dark_beats_keep_their_places(prove, interval):
    """In 12 clocks, with specular terms every so many: both terms of each beat leave once, in order, the
    specular one 0 where N.L is not above 0; what waits stays; no deadlock."""
    prove(of_light(interval), 12)


BUGS = {
    "a dark beat takes a term": ("specular.o.ready.eq(gives & ~skip)", "specular.o.ready.eq(gives)"),
    "a lit beat is not given": (
        "specular.i.valid.eq(self.i.valid & takes & ~dark)",
        "specular.i.valid.eq(0)",
    ),
    "a dark beat is given": ("self.i.valid & takes & ~dark", "self.i.valid & takes"),
    "it leaves before its term is there": ("(skip | specular.o.valid)", "1"),
    "the term of a dark beat is kept": ("Mux(skip, 0, ", "Mux(0, 0, "),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, plant, bug):
    """Planted in `LightUnit`, each refutes the claims."""
    plant(LightUnit, "_skip", *BUGS[bug])
    refute(of_light(2), 12)
