"""The span adapter: what the shading pipeline reads of the spans that geometry makes."""

from amaranth.hdl import Module, Value
from amaranth.lib import data

__all__ = ["connect_shading_span"]


def connect_shading_span(m: Module, span: data.View, shaded: data.View) -> None:
    """Wire a span of `EdgeNormalsUnit` to a span of the shading pipeline: `shading_spans` in hardware.

    Places and lengths lose the first bits that the pipeline does not have, as the picture is no larger.

    Parameters
    ----------
    m : Module
        Module that gets the wires.
    span : View
        Of `true_spans_shape`.
    shaded : View
        Of `blysk.hdl.pipeline.span_shape`.
    """
    for name in shaded.shape().members:
        m.d.comb += Value.cast(shaded[name]).eq(Value.cast(span[name]))
