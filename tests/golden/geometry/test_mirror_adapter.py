"""Components of R·V from vectors of three components, against float64."""

import numpy as np
import pytest

from blysk.bench.units.triangles import random_triangles
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.mirror_adapter import MirrorAdapter
from blysk.golden.geometry.triangles import FrameSettings


@pytest.mark.parametrize("degrees", [0, 20, 45, 80, 90])
def test_components(degrees):
    """Each product is in range, within half a step and the errors of the codes of sin a and cos a."""
    triangles = random_triangles(np.random.default_rng(5), 60, size=20.0, spread=0.5)
    spans, _ = Geometry(vectors=True).compute(triangles, FrameSettings(-100, -100, 100, 100))
    angle = np.radians(degrees)
    sine, cosine = QuotientSpans().codes_of(np.sin(angle), np.cos(angle))
    made = MirrorAdapter().compute(spans, sine, cosine)
    for name in ("start", "step"):
        given, found = getattr(spans, name).astype(float), getattr(made, name)
        used = slice(None) if name == "start" else spans.length > 1
        np.testing.assert_array_equal(found[:, [0, 2]], given[:, [0, 2]])
        exact = given[:, 1:2] * [np.cos(angle), np.sin(angle)]
        # The codes have the scale 1 - 2^-16, and are rounded.
        allowed = 0.5 + np.abs(given[:, 1:2]) * (2.0**-16 + 2.0**-18)
        assert (np.abs(found[:, [1, 3]] - exact) <= allowed)[used].all()
    last = made.start + made.step * (2.0**-made.exponent * (made.length - 1))[:, np.newaxis]
    assert np.abs(last[made.length > 1]).max() < 2**17
    QuotientSpans(mirror=True).differences(made.vectors, np.array([[sine, cosine]]))
