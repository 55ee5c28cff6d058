# amaranth: UnusedElaboratable=no
"""Proofs about the serial vector adapter: spans leave in order, none is lost, none is stuck."""

import pytest

from blysk.hdl.geometry.vector_adapter import SerialVectorAdapterUnit

from .prover import Harness
from .rules import answers, follows, stays, taken

pytestmark = pytest.mark.prove


def passes(came, leaves):
    return (came.y == leaves.y) & (came.length == leaves.length)


def of_spans():
    """One span is inside at most, from its last turn on; one that is offered stays, as a stream's does."""
    unit = SerialVectorAdapterUnit()
    h = Harness(unit)
    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, 1, passes)
    answers(h, inside.any(), taken(unit.o), unit.latency - 1, unit.o.ready)
    return h


def test_spans_leave_in_order(prove):
    """Inductive."""
    prove(of_spans())


@pytest.mark.parametrize(
    ("text", "bug"),
    [
        ("self.i.valid & ends & round_[1])", "self.i.valid & ends & round_[1] & place[0])"),
        ("moves & now.last", "moves & now.is_start"),
    ],
)
def test_bugs_are_found(refute, inject, text, bug):
    """A span is lost; the words beside its vectors are those of the next span, or of none."""
    inject(SerialVectorAdapterUnit, "elaborate", text, bug)
    refute(of_spans(), 30)
