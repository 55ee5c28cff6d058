"""Dot product: the bit-accurate model against integers of any size."""

import numpy as np
import pytest

from blysk.bench.units.operands import component_words, word_corners
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT


def exact(a, b):
    """The dot product in Python integers."""
    return (a.astype(object) * b.astype(object)).sum(axis=-1)


def test_stiff_is_exact_over_the_whole_word():
    rng = np.random.default_rng(1)
    words = rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (2, 100_000, 3))
    corners = word_corners(COMPONENT.min_code, COMPONENT.max_code, 0, -1)
    a, b = np.concatenate([words, corners], axis=1)
    result = DotProduct().compute(*component_words(a, b))
    assert result.format == DotProduct().result_format == SQ(4, 34)
    assert (result.codes == exact(a, b)).all()
    assert result.codes.max() == 3 * 2**34 <= result.format.max_code
    assert result.values.max() == 3


def test_other_formats_and_broadcast():
    rng = np.random.default_rng(2)
    unit = DotProduct(SQ(2, 10), UQ(3, 5))
    a, b = rng.integers(-2048, 2048, (50, 1, 3)), rng.integers(0, 256, (7, 3))
    result = unit.compute(Fixed(SQ(2, 10), a), Fixed(UQ(3, 5), b))
    assert result.shape == (50, 7)
    assert result.format == unit.result_format
    assert (result.codes == exact(a, b)).all()


def test_other_operands_are_refused():
    good, bad = Fixed(COMPONENT, [1, 2, 3]), Fixed(SQ(2, 16), [1, 2, 3])
    for a, b in ((bad, good), (good, bad)):
        with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\) and SQ\(1, 17\), not "):
            DotProduct().compute(a, b)
