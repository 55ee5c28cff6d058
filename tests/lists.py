"""Names of reflection models by family, for parametrised tests."""

from blysk.golden.presets import MODELS
from blysk.golden.reference.reflection import REFLECTION_MODELS, AngleCosine, PolynomialModel

__all__ = ["COSCOS_MODELS", "FURTHER_MODELS", "KINDS", "LINE_MODELS", "SPECULAR_MODELS"]

SPECULAR_MODELS = ("cosquad", "cosquad7", "cosquad_lin")
"""Those of the documents' figures, all of one latency."""

FURTHER_MODELS = tuple(name for name in MODELS if name not in (*SPECULAR_MODELS, "blinn_product"))
"""The others that the specular unit serves."""

KINDS = tuple({type(unit.model): name for name, unit in MODELS.items()}.values())
"""A model of each kind of specular unit. Methods meet models at a stream: what a method is to send depends on
the kind alone."""

LINE_MODELS = tuple(name for name, model in REFLECTION_MODELS.items() if isinstance(model, PolynomialModel))
"""Powers of a line."""

COSCOS_MODELS = {
    name: (model.power, model.rule)
    for name, model in REFLECTION_MODELS.items()
    if isinstance(model, AngleCosine)
}
"""Power and rule of each ``cos^k(a gamma)``."""
