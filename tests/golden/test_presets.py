"""Designs by name: a line about each method and model, and names that there are not."""

import pytest

from blysk.golden.presets import (
    LOBES,
    METHOD_LINES,
    METHODS,
    MIRROR_LOBES,
    MODEL_LINES,
    MODELS,
    PUBLISHED,
    preset,
)


def test_every_name_has_a_line():
    assert list(METHOD_LINES) == [*METHODS, *PUBLISHED]
    assert set(MODEL_LINES) == {*MODELS, *LOBES, *MIRROR_LOBES}
    for name, line in (METHOD_LINES | MODEL_LINES).items():
        assert line, name
        assert len(line) <= 80, name


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ({"method": "slurp"}, "^method must be one of .*linear.*, not 'slurp'$"),
        ({"model": "shiny"}, "^model must be one of .*ggx.*, not 'shiny'$"),
    ],
)
def test_unknown_names(names, message):
    with pytest.raises(ValueError, match=message):
        preset(**names)
