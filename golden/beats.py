"""Input and output of the shading pipeline: raster spans, and pixels."""

from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.cosines.quotient_spans import SpanVectors

__all__ = ["Pixels", "Spans"]


@dataclass(frozen=True)
class Spans:
    """Raster spans with quantised normals: the pipeline's input.

    Parameters
    ----------
    x, y : int arrays, shape (spans,)
        First pixel of each span, 0 to the largest coordinate of the pipeline, which is at most 4095.
    length : int array, shape (spans,)
        Number of pixels, 0 to 4095. A span of length 0 gives no pixel. After the largest x, x goes on from 0.
    normal_left, normal_right : int arrays, shape (spans, 3)
        Unit normals at the first and the last pixel centre, as codes of ``SQ(1, 17)``. For a method that
        takes other vectors: these vectors, as codes of its `Interpolator.END_FORMAT`. 0 for a method that
        reads ``values`` or ``vectors``.
    material : int array, shape (spans,), optional
        Index of the material. Empty: 0 for all.
    values : SpanValues, optional
        Values of each light, for methods that read no normals, see `LocalChordInterpolator`.
    factors : int64 array, shape (spans, factors, 3), optional
        For spans with values: codes of the factors of `ShadingPipeline.factors`, in the format of N·L.
    vectors : SpanVectors, optional
        Vectors at the first pixel and their step, for methods that read no normals, see
        `QuotientInterpolator`.
    attributes : SpanAttributes, optional
        Vertex colours and texture coordinates, for a design with an albedo.

    Raises
    ------
    ValueError
        If ``material`` has another number of entries than there are spans.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray
    material: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    values: SpanValues | None = None
    factors: np.ndarray | None = None
    vectors: SpanVectors | None = None
    attributes: SpanAttributes | None = None

    def __post_init__(self) -> None:
        material = np.asarray(self.material)
        if not material.size:
            material = np.zeros(len(self.length), dtype=np.int64)
        if material.shape != (len(self.length),):
            raise ValueError(f"material must be an index for each of the {len(self.length)} spans, or empty")
        object.__setattr__(self, "material", material)

    def __len__(self) -> int:
        return len(self.length)

    def __getitem__(self, which: slice | np.ndarray) -> "Spans":
        """Some of the spans, by a slice, indices or a mask."""
        values = self.values if self.values is None else SpanValues(*(codes[which] for codes in self.values))
        fields = ("x", "y", "length", "normal_left", "normal_right", "material")
        chosen = {name: getattr(self, name)[which] for name in fields}
        factors = self.factors if self.factors is None else self.factors[which]
        found = Spans(**chosen, values=values, factors=factors)
        if self.vectors is not None:
            found = replace(found, vectors=cast(SpanVectors, self.vectors[which]))
        if self.attributes is not None:
            found = replace(found, attributes=cast(SpanAttributes, self.attributes[which]))
        return found


@dataclass(frozen=True)
class Pixels:
    """Pixels: the pipeline's output.

    Parameters
    ----------
    x, y : int arrays, shape (pixels,)
        Column and row.
    color : uint8 array, shape (pixels, 3)
        Red, green, blue.
    last : bool array, shape (pixels,)
        Whether a pixel is the last of its span.
    out_of_range_spans : int
        Number of spans with a larger angle than the method serves. Their pixels have no error bound.
    """

    x: np.ndarray
    y: np.ndarray
    color: np.ndarray
    last: np.ndarray
    out_of_range_spans: int
