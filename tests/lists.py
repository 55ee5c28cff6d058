"""Names of reflection models by family, and names of units, for parametrised tests."""

from blysk.golden.presets import MODELS
from blysk.golden.reference.reflection import REFLECTION_MODELS, AngleCosine, PolynomialModel

__all__ = [
    "COSCOS_MODELS",
    "FURTHER_MODELS",
    "KINDS",
    "LINE_MODELS",
    "OF_DOCUMENTS",
    "SPECULAR_MODELS",
    "WHOLE",
]

SPECULAR_MODELS = ("cosquad", "cosquad7", "cosquad_lin")
"""Models of the documents' figures, all with the same latency."""

FURTHER_MODELS = tuple(name for name in MODELS if name not in (*SPECULAR_MODELS, "blinn_product"))
"""The other models that the specular unit serves."""

KINDS = tuple({type(unit.reflection): name for name, unit in MODELS.items()}.values())
"""A model of each kind of specular unit.

Methods and models meet at a stream, so the data that a method sends depend only on the kind.
"""

LINE_MODELS = tuple(name for name, model in REFLECTION_MODELS.items() if isinstance(model, PolynomialModel))
"""Powers of a line."""

COSCOS_MODELS = {
    name: (model.power, model.rule)
    for name, model in REFLECTION_MODELS.items()
    if isinstance(model, AngleCosine)
}
"""Power and rule of each ``cos^k(a gamma)``."""

OF_DOCUMENTS = (
    *(
        "adaptive_normaliser",
        "bisection",
        "bisection_chain",
        "bisection_interpolator",
        "half_chord",
        "arccos",
    ),
    *("angular_interpolator", "angular_setup", "recurrence", "recurrence_interpolator", "recurrence_setup"),
    *("middle_normal", "quadratic_evaluator", "quadratic_interpolator", "gpq", "line_setup"),
    *("half_chord", "difference_setup", "linear_interpolator"),
)
"""Units that only the documents' methods have. They change seldom."""

WHOLE = (
    *("geometry", "render", "pixel_pipelines", "framing", "registers", "serialiser", "motion"),
    *("draw_commands", "mesh_memory", "vertex_unit", "triangle_assembly", "tmds_encoder"),
    *("packet_decoder", "uart_receiver"),
)
"""Units that are no parts of geometry or of pipelines."""
