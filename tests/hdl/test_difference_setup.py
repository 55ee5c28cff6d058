"""Difference setup unit: RTL against its twin, clock by clock."""

import numpy as np

from golden.difference_setup import DifferenceSetup
from golden.fixed import Fixed
from golden.gpq import GPQ
from golden.unit_vector import COMPONENT
from hdl.difference_setup import DifferenceSetupUnit


def test_equals_twin_for_every_length(verify):
    rng = np.random.default_rng(4)
    length = np.r_[np.arange(1, 4096), rng.integers(1, 40, 500)]
    g, p, q = (
        rng.integers(format.min_code, format.max_code + 1, (len(length), 3))
        for format in (GPQ.G_FORMAT, GPQ.P_FORMAT, COMPONENT)
    )
    g[:30], p[:30] = GPQ.G_FORMAT.min_code, GPQ.P_FORMAT.min_code
    g[30:60], p[30:60] = GPQ.G_FORMAT.max_code, GPQ.P_FORMAT.max_code
    first, second = DifferenceSetup().compute(Fixed(GPQ.G_FORMAT, g), Fixed(GPQ.P_FORMAT, p), length)
    verify(
        DifferenceSetupUnit(),
        {"g": g, "p": p, "q": q, "length": length},
        {"start": q, "first": first.codes, "second": second.codes, "length": length},
    )
