"""Errors of short words on a small frame are over those of exact shading, and under a whole highlight."""

import pytest

from blysk.bench.report.short_words import EXPONENTS, measure_short, tasks
from blysk.golden.rivals.short_words import SHORT_WORDS


@pytest.mark.parametrize("words", SHORT_WORDS)
def test_errors_of_a_small_frame(words):
    found = measure_short(words, "teapot-300", (48, 36))
    assert 0.5 < max(found["errors"]) < 140
    assert len(found["errors"]) == len(EXPONENTS)


def test_all_words_on_all_meshes():
    assert len({task.key for task in tasks(True)}) == 2 * len(SHORT_WORDS)
