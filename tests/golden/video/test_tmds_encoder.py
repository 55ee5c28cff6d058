"""TMDS against DVI 1.0's flow chart written bit by bit, over every byte and every disparity."""

import numpy as np
import pytest

from blysk.golden.video.tmds_encoder import (
    BITS,
    CLOCK_WORD,
    CONTROL_WORDS,
    MAX_DISPARITY,
    TmdsEncoder,
    bits_of,
)

ENCODER = TmdsEncoder()


def flow_chart(byte, count):
    """Word as a string of bits 0 to 9, and the disparity after it, by figure 3-5, box by box."""
    d = [int(bit) for bit in f"{byte:08b}"[::-1]]
    q = [d[0]]
    if d.count(1) > 4 or (d.count(1) == 4 and d[0] == 0):
        for bit in d[1:]:
            q.append(1 if q[-1] == bit else 0)
        q.append(0)
    else:
        for bit in d[1:]:
            q.append(1 if q[-1] != bit else 0)
        q.append(1)
    ones, zeros = q[:8].count(1), q[:8].count(0)
    if count == 0 or ones == zeros:
        if q[8]:
            return [*q[:8], 1, 0], count + ones - zeros
        return [*(1 - bit for bit in q[:8]), 0, 1], count + zeros - ones
    if (count > 0 and ones > zeros) or (count < 0 and zeros > ones):
        return [*(1 - bit for bit in q[:8]), q[8], 1], count + 2 * q[8] + zeros - ones
    return [*q[:8], q[8], 0], count - 2 * (1 - q[8]) + ones - zeros


@pytest.fixture(scope="module")
def every():
    """Words and the disparities after them, by byte and disparity before."""
    states = np.arange(-MAX_DISPARITY, MAX_DISPARITY + 2, 2)
    return states, *ENCODER.step(ENCODER.chain(np.arange(256))[:, np.newaxis], states)


def test_every_byte_at_every_disparity(every):
    states, words, after = every
    for byte in range(256):
        for k, state in enumerate(states.tolist()):
            bits, count = flow_chart(byte, state)
            assert bits == bits_of(words[byte, k]).tolist()
            assert count == after[byte, k]


def test_disparities_reached(every):
    """From 0, every even disparity up to the bound is reached, and none beyond."""
    states, _, after = every
    reached = {0}
    for _ in states:
        reached |= set(after[:, np.isin(states, sorted(reached))].ravel().tolist())
    assert sorted(reached) == states.tolist()


def test_words(every):
    """Each word decodes, and its disparity follows from its bits.

    Words have at most five transitions, control words at least seven.
    """
    states, words, after = every
    np.testing.assert_array_equal(ENCODER.decode(words), np.arange(256)[:, np.newaxis] + 0 * states)
    np.testing.assert_array_equal(2 * bits_of(words).sum(-1) - BITS, after - states)
    transitions = np.abs(np.diff(bits_of(words))).sum(-1)
    assert transitions.max() == 5
    assert np.abs(np.diff(bits_of(np.array(CONTROL_WORDS)))).sum(-1).min() == 7
    assert not set(words.ravel().tolist()) & set(CONTROL_WORDS)
    assert bits_of(CLOCK_WORD).tolist() == [0] * 5 + [1] * 5


def test_stream_is_the_flow_chart_in_turn():
    rng = np.random.default_rng(2026)
    data, control = rng.integers(0, 256, 3000), rng.integers(0, 4, 3000)
    active = rng.random(3000) < 0.97
    count, expected = 0, []
    for byte, code, is_active in zip(data.tolist(), control.tolist(), active.tolist(), strict=True):
        if is_active:
            bits, count = flow_chart(byte, count)
            expected.append(sum(bit << k for k, bit in enumerate(bits)))
        else:
            expected.append(CONTROL_WORDS[code])
            count = 0
    np.testing.assert_array_equal(ENCODER.compute(data, control, active), expected)
