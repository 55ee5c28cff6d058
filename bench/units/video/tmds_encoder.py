"""Record of the TMDS encoder."""

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.hdl.video.tmds_encoder import TmdsEncoderUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    return unit.model.compute(**case.beats)


def _lines(unit, rng, count):
    """Lines of random bytes between control periods of all four kinds."""
    return Case(
        {
            "data": rng.integers(0, 256, count),
            "control": rng.integers(0, 4, count),
            "active": (np.arange(count) % 40 >= 8).astype(np.int64),
        }
    )


def _grey(unit, rng, count):
    """Runs of each of the 256 bytes without a control period, to test the balance."""
    data = np.resize(np.repeat(rng.permutation(256), 12), count)
    return Case({"data": data, "control": np.zeros_like(data), "active": np.ones_like(data)})


RECORD = Record(
    name="tmds_encoder",
    title="TMDS word of a byte or of a control period",
    source="docs/theory/video.md#tmds",
    variants={"": Variant(TmdsEncoderUnit, note="exact")},
    expect=_expect,
    stimuli={"lines": Stimulus(_lines, 2000), "grey": Stimulus(_grey, 3072)},
    axis="",
)
