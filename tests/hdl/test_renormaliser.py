"""Direct renormaliser: RTL against its twin, clock by clock."""

import numpy as np

from golden.fixed import Fixed
from golden.renormaliser import Renormaliser
from golden.unit_vector import COMPONENT
from hdl.renormaliser import RenormaliserUnit


def test_equals_twin(verify):
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(4000, 3))
    vectors *= rng.uniform(0.6, 1.1, (4000, 1)) / np.linalg.norm(vectors, axis=1, keepdims=True)
    codes = np.floor(vectors / COMPONENT.step).astype(np.int64)
    any_size = rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (1000, 3))
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (300, 3))
    codes = np.clip(np.vstack([codes, any_size, ends]), COMPONENT.min_code, COMPONENT.max_code)
    codes = rng.permutation(codes)
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, codes))
    assert 0 < outside.sum() < len(codes)
    verify(RenormaliserUnit(), codes, {"normal": normals.codes, "outside": outside})


def test_every_segment_and_its_ends(verify):
    # Vectors (x, y, 0) with x^2 + y^2 next below and next above every border of a segment.
    parameters = Renormaliser()
    borders = (parameters.LOW + np.arange(parameters.SEGMENTS + 1) / 32) * 2.0**34
    x = np.floor(np.sqrt(borders) * 0.7).astype(np.int64)
    y = np.sqrt(borders - x * x).astype(np.int64)
    near = [np.stack([x, y + offset, np.zeros_like(x)], axis=1) for offset in (-1, 0, 1, 2)]
    codes = np.vstack(near)
    normals, outside = parameters.compute(Fixed(COMPONENT, codes))
    assert set(outside.tolist()) == {True, False}
    verify(RenormaliserUnit(), codes, {"normal": normals.codes, "outside": outside})
