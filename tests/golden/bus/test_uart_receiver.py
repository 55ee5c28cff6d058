"""UART: bytes of a line, of senders that are too fast or too slow, and lines that are none."""

import numpy as np
import pytest

from blysk.golden.bus.uart_receiver import UartReceiver

EVERY = bytes(range(256))


@pytest.mark.parametrize("divisor", [32, 56, 280, 672])
def test_every_byte_arrives(divisor):
    receiver = UartReceiver(divisor)
    found, errors = receiver.compute(receiver.line(EVERY, 50))
    assert bytes(found.astype(np.uint8)) == EVERY
    assert errors == 0


@pytest.mark.parametrize(("rate", "arrives"), [(1.04, True), (0.96, True), (1.09, False), (0.91, False)])
def test_other_rates(rate, arrives):
    """At 3 Mbaud and 52.5 MHz a sender may be off by 4 %."""
    receiver, data = UartReceiver.of(52.5e6, 3e6), b"\x00\xaa\xff" * 50
    line = UartReceiver(round(receiver.divisor * rate)).line(data, 50)
    found, errors = receiver.compute(line)
    assert (bytes(found.astype(np.uint8)) == data and errors == 0) == arrives


def test_a_line_without_bytes():
    """A line of zeros is a framing error, and no byte begins before it is 1. A short zero is no byte."""
    receiver = UartReceiver(160)
    found, errors = receiver.compute(np.r_[np.zeros(1000), np.ones(30), receiver.line(b"a", 20)].astype(int))
    assert (found.tolist(), errors) == ([97], 1)
    found, errors = receiver.compute(np.r_[1, 0, 0, 0, 0, np.ones(200)].astype(int))
    assert (found.tolist(), errors) == ([], 0)
    with pytest.raises(ValueError, match=r"a bit must have 2 cycles or more, not 1\.9375"):
        UartReceiver(31)
