"""Lengths and pixels of spans."""

import numpy as np
import pytest

from blysk.golden.number.spans import checked_lengths, pixels_of, runs_of


def test_pixels_of():
    span, index = pixels_of(np.array([2, 1, 0, 3]))
    assert span.tolist() == [0, 0, 1, 3, 3, 3]
    assert index.tolist() == [0, 1, 0, 0, 1, 2]
    assert [len(a) for a in pixels_of(np.array([], dtype=int))] == [0, 0]


def test_runs_have_every_span_once_and_few_pixels():
    length = np.random.default_rng(1).integers(0, 40, 500)
    length[100] = 300
    runs = list(runs_of(length, 100))
    assert [s for run in runs for s in range(run.start, run.stop)] == list(range(500))
    assert all(length[run].sum() <= 100 or run.stop - run.start == 1 for run in runs)
    assert len(runs) < length.sum() / 50


@pytest.mark.parametrize("least", [0, 1])
def test_lengths_out_of_range_are_refused(least):
    assert checked_lengths([least, 4095], least).dtype == np.int64
    for length in (least - 1, 4096):
        with pytest.raises(ValueError, match=rf"^lengths must be {least} to 4095$"):
            checked_lengths([5, length], least)
