"""The shading pipeline: spans in, pixels out; which methods and models there are, and the bit-true twin."""

from dataclasses import dataclass

import numpy as np

from .difference_accumulator import DifferenceAccumulator
from .difference_setup import DifferenceSetup
from .diffuse import Diffuse
from .dot_product import DotProduct
from .fixed import Fixed
from .frame_constants import FrameConstants
from .gpq import GPQ
from .intensity import Intensity
from .middle_normal import MiddleNormal
from .specular import SPECULAR_MODELS, Specular
from .unit_vector import COMPONENT

__all__ = ["METHODS", "Pixels", "ShadingPipeline", "Spans"]

METHODS = {"quadratic": SPECULAR_MODELS}
"""Normal interpolation methods of the pipeline, each with the reflection models it serves."""

_LARGEST_PLACE = 4095

# Pixels shaded at once; bounds the memory, changes no result.
_CHUNK = 1 << 18


@dataclass(frozen=True)
class Spans:
    """The pipeline's input: raster spans with quantised normals.

    Parameters
    ----------
    x, y : int arrays, shape (spans,)
        First pixel of each span, 0 to 4095.
    length : int array, shape (spans,)
        Pixels, 0 to 4095. A span of length 0 gives no pixel; one that goes past x = 4095 starts again at 0.
    normal_left, normal_right : int arrays, shape (spans, 3)
        Unit normals at the first and last pixel centre, codes of ``SQ(1, 17)``.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray

    def __len__(self):
        return len(self.length)


@dataclass(frozen=True)
class Pixels:
    """The pipeline's output.

    Parameters
    ----------
    x, y : int arrays, shape (pixels,)
        Place.
    color : uint8 array, shape (pixels, 3)
        Red, green, blue.
    last : bool array, shape (pixels,)
        Whether a pixel is the last of its span.
    wide_spans : int
        Spans over `golden.middle_normal.MAX_SPAN_ANGLE`, whose normals are not to be trusted.
    """

    x: np.ndarray
    y: np.ndarray
    color: np.ndarray
    last: np.ndarray
    wide_spans: int


@dataclass(frozen=True)
class ShadingPipeline:
    """Middle normal, G/P/Q, difference setup, accumulator; diffuse and specular of each light; intensity.

    The bit-true twin composes those of the devices; nothing is rounded in between. Formats and error bounds
    are theirs.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    model : str
        A reflection model that the method serves.
    lights : int
        Number of lights, 1 to 16.

    Raises
    ------
    ValueError
        If the method or the number of lights is unknown, or the method does not serve the model.
    """

    method: str = "quadratic"
    model: str = "cosquad"
    lights: int = 1

    def __post_init__(self):
        if self.method not in METHODS:
            raise ValueError(f"method must be one of {', '.join(METHODS)}, not {self.method!r}")
        served = METHODS[self.method]
        if self.model not in served:
            raise ValueError(f"method {self.method} serves {', '.join(served)}, not {self.model!r}")
        Intensity(self.lights)

    def compute(self, spans: Spans, constants: FrameConstants) -> Pixels:
        """Bit-true pixels, in the order of the spans.

        Raises
        ------
        ValueError
            If a code is out of range, or the constants are for another number of lights.
        """
        if len(constants.direction) != self.lights:
            raise ValueError(f"the constants are for {len(constants.direction)} lights, not {self.lights}")
        for name in ("x", "y", "length"):
            codes = np.asarray(getattr(spans, name))
            if codes.size and not 0 <= codes.min() <= codes.max() <= _LARGEST_PLACE:
                raise ValueError(f"{name} must be 0 to {_LARGEST_PLACE}")
        kept = np.flatnonzero(np.asarray(spans.length) > 0)
        length = np.asarray(spans.length, dtype=np.int64)[kept]
        left, right = (Fixed(COMPONENT, codes[kept]) for codes in (spans.normal_left, spans.normal_right))
        middle, wide = MiddleNormal().compute(left, right)
        g, p, q = GPQ().compute(left, middle, right)
        first, second = DifferenceSetup().compute(g, p, length)

        span = np.repeat(np.arange(len(kept)), length)
        step = np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)
        color = np.empty((len(span), 3), dtype=np.uint8)
        for start in range(0, len(span), _CHUNK):
            part = slice(start, start + _CHUNK)
            normals = DifferenceAccumulator().compute(q, first, second, span[part], step[part])
            color[part] = self._shade(normals, constants)
        return Pixels(
            x=(np.asarray(spans.x)[kept][span] + step) & _LARGEST_PLACE,
            y=np.asarray(spans.y)[kept][span],
            color=color,
            last=step == length[span] - 1,
            wide_spans=int(np.count_nonzero(wide)),
        )

    def _shade(self, normals: Fixed, constants: FrameConstants) -> np.ndarray:
        dot, diffuse_unit, specular_unit = DotProduct(), Diffuse(), Specular(self.model)
        diffuse, specular = [], []
        for direction, halfway in zip(constants.direction, constants.halfway, strict=True):
            cosine = dot.compute(normals, Fixed(COMPONENT, direction))
            dark = diffuse_unit.dark(cosine)
            highlight = dot.compute(normals, Fixed(COMPONENT, halfway))
            diffuse.append(diffuse_unit.compute(cosine).codes)
            specular.append(specular_unit.compute(highlight, dark, constants.exponent).codes)
        term = Intensity.TERM_FORMAT
        colors = (constants.ambient, constants.diffuse, constants.specular)
        return Intensity(self.lights).compute(
            *(Fixed(Intensity.COLOR_FORMAT, codes) for codes in colors),
            Fixed(term, np.stack(diffuse, axis=-1)),
            Fixed(term, np.stack(specular, axis=-1)),
        )
