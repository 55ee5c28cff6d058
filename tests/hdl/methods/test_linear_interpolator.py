"""Linear interpolation in the pipeline: the flag of wide spans, once a span, at whatever pixel shows it."""

import numpy as np
import pytest

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate

WHITE = Intensity.color(np.ones((1, 3)))


def flags_of(renormalised, left, right, length):
    left, right = (Fixed(COMPONENT, codes) for codes in (left, right))
    return LinearInterpolator(renormalised=renormalised).normals(left, right, length)[1]


def spans_of_every_kind(rng, normal_pairs, count):
    """Ends of any angle, and of any codes; of length 0 and 1 too."""
    left, right = (quantise(n) for n in normal_pairs(rng, count, rng.uniform(0, 180, count)))
    kind = rng.integers(0, 4, count)
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1, ONE // 2], (2, count, 3))
    left = np.where((kind == 0)[:, np.newaxis], ends[0], left)
    right = np.where((kind == 0)[:, np.newaxis], ends[1], right)
    right = np.where((kind == 1)[:, np.newaxis], left, right)
    return left, right, rng.integers(0, 12, count)


@pytest.mark.long
@pytest.mark.parametrize(("method", "interval"), [("linear", 4), ("renormalise", 1), ("renormalise", 4)])
def test_stiff_flags_under_stalls(normal_pairs, method, interval):
    """As many as the twin has, whichever spans come together; runs of one kind, and all mixed."""
    rng = np.random.default_rng(interval)
    design = preset(method, "cosquad")
    unit = ShadingPipelineUnit(design.built(setup_interval=interval))
    left, right, length = spans_of_every_kind(rng, normal_pairs, 400)
    renormalised = method == "renormalise"
    kept = np.maximum(length, 1)
    far, shown = flags_of(False, left, right, kept), flags_of(renormalised, left, right, kept)
    # Flagged for the difference alone, for a pixel alone, for neither; all of a kind, then mixed.
    kinds = [np.flatnonzero(far), np.flatnonzero(shown & ~far), np.flatnonzero(~shown)]
    assert all(len(kind) > 20 for kind in (kinds if renormalised else kinds[::2]))
    light = quantise(np.array([[0.6, 0.0, 0.8]]))
    constants = FrameConstants(20, Intensity.color(np.zeros(3)), light, light, WHITE, WHITE)
    for chosen in (*kinds, np.arange(400)):
        zeros = np.zeros(len(chosen), dtype=np.int64)
        spans = Spans(zeros, zeros, length[chosen], left[chosen], right[chosen])
        pixels = design.compute(spans, constants)
        assert pixels.out_of_range_spans == np.count_nonzero(shown[chosen] & (length[chosen] > 0))
        beats = {name: getattr(spans, name) for name in ("x", "y", "length", "normal_left", "normal_right")}
        for input_share, output_share in ((0, 0), (0.5, 0.5), (0.95, 0), (0, 0.7)):
            result = simulate(
                unit,
                beats,
                count=len(pixels.x),
                write=constants.writes(),
                engine="auto",
                input_stalls=rng.random(997) < input_share,
                output_stalls=rng.random(1009) < output_share,
            )
            np.testing.assert_array_equal(np.stack([result.beats[c] for c in "rgb"], axis=1), pixels.color)
            assert result.status["out_of_range_spans"] == pixels.out_of_range_spans
