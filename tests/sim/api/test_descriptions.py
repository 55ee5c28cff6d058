"""A line for each method and model, no more and no less."""

from blysk.golden.presets import LOBES, METHODS, MODELS, PUBLISHED
from blysk.sim.api.descriptions import METHOD_LINES, MODEL_LINES, described


def test_every_name_has_a_line():
    assert set(METHOD_LINES) == {*METHODS, *PUBLISHED}
    assert set(MODEL_LINES) == {*MODELS, *LOBES, "phong"}
    for lines in (METHOD_LINES, MODEL_LINES):
        rows = described(lines).split("\n")
        assert len(rows) == len(lines)
        assert all(len(row) <= 110 for row in rows)
