# amaranth: UnusedElaboratable=no
"""Refusals of FIFOs made from memories. Proofs of the units that use these FIFOs cover their behaviour."""

import re

import pytest
from amaranth.hdl import Const, Module
from amaranth.lib import stream

from blysk.hdl.core.memory import UNCOUNTED, connect_headed_fifo, connect_late_fifo


@pytest.mark.parametrize("depth", [1, 2, 3, 12])
def test_headed_fifo_refuses_a_depth(depth):
    """With two words no payload would ever be accepted."""
    source, sink = (stream.Signature(8).create(path=(name,)) for name in ("source", "sink"))
    with pytest.raises(ValueError, match=re.escape(f"depth must be a power of two from 4 on, not {depth}")):
        connect_headed_fifo(Module(), "words", source, sink, Const(0, 1), depth)


def test_late_fifo_refuses_a_depth():
    """With so few words no payload would ever be accepted."""
    source, sink = (stream.Signature(8).create(path=(name,)) for name in ("source", "sink"))
    with pytest.raises(ValueError, match=f"depth must be over {UNCOUNTED}, not {UNCOUNTED}"):
        connect_late_fifo(Module(), "words", source, sink, UNCOUNTED)
