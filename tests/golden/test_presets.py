"""Designs by name: a line about each method and model, and refusals of unknown names."""

import numpy as np
import pytest

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import (
    LOBES,
    METHOD_LINES,
    METHODS,
    MIRROR_LOBES,
    MODEL_LINES,
    MODELS,
    PUBLISHED,
    default_method,
    preset,
)
from blysk.golden.reference.lobes import TabulatedModel


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


CURVE = TabulatedModel.of_points("curve", np.array([0.0, 0.5, 1.0]), np.array([0.1, 0.2, 1.0]))


@pytest.mark.parametrize("model", [*MODELS, *LOBES, *MIRROR_LOBES, CURVE, None], ids=str)
def test_the_default_method_serves_every_model(model):
    """The default follows from the unit of the model: ``quotient`` if the model has a table."""
    made = preset(model=model)
    assert made.method == ("renormalise" if model in MODELS else "quotient")
    assert made == preset(default_method(model), model)
    assert made.loads_tables == (model is not None and model not in MODELS)
    assert ShadingPipeline() == preset()


@pytest.mark.parametrize(
    ("asked", "method"),
    [
        ({"gate": True}, "quadratic"),
        ({"gate": True, "model": "cosquad", "operand": "one_minus_cosine"}, "quadratic"),
        ({"operand": "cosine"}, "renormalise"),
        ({"setup_interval": 6}, "renormalise"),
    ],
    ids=str,
)
def test_the_default_of_what_quotient_lacks(asked, method):
    assert preset(**asked) == preset(method, **asked)
    assert default_method(**asked | {"model": "phong"}) == "quotient"
    assert not METHODS["quotient"].serves_gate
    assert not METHODS["renormalise"].serves_gate
