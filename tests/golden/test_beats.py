"""Spans whose arrays do not fit each other are refused."""

import numpy as np
import pytest

from blysk.golden.beats import Spans


@pytest.mark.parametrize("material", [None, np.zeros(3, int), np.zeros((2, 1), int)])
def test_material_must_be_an_index_for_each_span(material):
    words, normals = np.zeros((3, 2), int), np.zeros((2, 2, 3), int)
    assert Spans(*words, *normals).material.tolist() == [0, 0]
    with pytest.raises(ValueError, match=r"^material must be an index for each of the 2 spans, or empty$"):
        Spans(*words, *normals, material)
