"""G/P/Q unit: RTL against its twin, clock by clock."""

import numpy as np

from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.gpq import GPQUnit


def test_equals_twin(verify):
    rng = np.random.default_rng(3)
    left, right = (rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (2000, 3)) for _ in range(2))
    middle = rng.integers(MiddleNormal.FORMAT.min_code, MiddleNormal.FORMAT.max_code + 1, (2000, 3))
    left[:8], middle[:8], right[:8] = COMPONENT.min_code, MiddleNormal.FORMAT.max_code, COMPONENT.min_code
    left[8:16], middle[8:16] = COMPONENT.max_code, MiddleNormal.FORMAT.min_code
    # Spans as they are: the middle close to the mean of the ends, where nothing saturates.
    right[1000:] = np.clip(left[1000:] + rng.integers(-40000, 40000, (1000, 3)), -131071, 131071)
    middle[1000:] = 2 * (left[1000:] + right[1000:]) + rng.integers(-9000, 9000, (1000, 3))
    middle = np.clip(middle, MiddleNormal.FORMAT.min_code, MiddleNormal.FORMAT.max_code)
    g, p, q = GPQ().compute(
        Fixed(COMPONENT, left), Fixed(MiddleNormal.FORMAT, middle), Fixed(COMPONENT, right)
    )
    verify(
        GPQUnit(),
        {"normal_left": left, "normal_middle": middle, "normal_right": right},
        {"g": g.codes, "p": p.codes, "q": q.codes},
    )
