"""The span adapter: what the shading pipeline reads of the spans that geometry makes."""

from blysk.golden.geometry.edge_normals import TrueSpans
from blysk.golden.pipeline import Spans

__all__ = ["shading_spans"]


def shading_spans(spans: TrueSpans) -> Spans:
    """Spans of the shading pipeline: place, length, unit normals at both ends, material.

    Geometry gives more than that, which no method reads yet: the true middle normal, and N/W at both ends.

    Parameters
    ----------
    spans : TrueSpans
        From `EdgeNormals`.
    """
    return Spans(
        x=spans.x,
        y=spans.y,
        length=spans.length,
        normal_left=spans.normal_left,
        normal_right=spans.normal_right,
        material=spans.material,
    )
