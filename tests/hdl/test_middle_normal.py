"""Middle normal unit: RTL against its twin, clock by clock."""

import numpy as np

from golden.fixed import Fixed
from golden.middle_normal import MiddleNormal
from golden.unit_vector import COMPONENT, quantise
from hdl.middle_normal import MiddleNormalUnit


def test_equals_twin(verify, normal_pairs):
    rng = np.random.default_rng(2)
    angles = np.r_[np.zeros(20), rng.uniform(0, 45, 1500), np.full(20, 45), rng.uniform(45, 180, 300), [180]]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    # Not only unit vectors: every word at its ends must not upset what follows.
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 6))
    left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
    middle, wide = MiddleNormal().compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    verify(
        MiddleNormalUnit(),
        {"normal_left": left, "normal_right": right},
        {"normal_left": left, "normal_right": right, "normal_middle": middle.codes, "wide": wide},
    )
