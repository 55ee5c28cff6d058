"""The shading pipeline: spans in, pixels out; which methods and models there are, and the bit-true twin."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .angular_interpolator import AngularInterpolator
from .bisection_interpolator import BisectionInterpolator
from .chord_interpolator import ChordInterpolator
from .diffuse import Diffuse
from .fixed import Fixed
from .frame_constants import MAX_MATERIALS, FrameConstants
from .intensity import Intensity
from .interpolator import Interpolator, NormalInterpolator, Operand, pixels_of
from .linear_interpolator import LinearInterpolator
from .power import Power
from .quadratic_interpolator import QuadraticInterpolator
from .recurrence_interpolator import RecurrenceInterpolator
from .specular import FURTHER_MODELS, SPECULAR_MODELS, Specular
from .unit_vector import COMPONENT

__all__ = ["METHODS", "MODELS", "Pixels", "ShadingPipeline", "Spans"]

METHODS: dict[str, Interpolator] = {
    "linear": LinearInterpolator(),
    "bisection": BisectionInterpolator(),
    "quadratic": QuadraticInterpolator(),
    "quadratic-eval": QuadraticInterpolator(form="direct"),
    "quadratic-horner": QuadraticInterpolator(form="horner"),
    "angular": AngularInterpolator(),
    "recurrence": RecurrenceInterpolator(),
    "renormalise": LinearInterpolator(renormalised=True),
    "chord": ChordInterpolator(),
}
"""Interpolation methods of the pipeline."""

MODELS = (*SPECULAR_MODELS, *FURTHER_MODELS, "blinn")
"""Reflection models of the pipeline; every method serves each."""

_LARGEST_PLACE = 4095

_CHUNK = 1 << 18
"""Pixels shaded at once."""


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
    material : int array, shape (spans,), optional
        Index of the material; ``None``: 0 for all.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray
    material: np.ndarray | None = None

    def __post_init__(self):
        if self.material is None:
            object.__setattr__(self, "material", np.zeros(len(self.length), dtype=np.int64))

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
        Spans wider than the method can shade, whose pixels are not to be trusted.
    """

    x: np.ndarray
    y: np.ndarray
    color: np.ndarray
    last: np.ndarray
    wide_spans: int


@dataclass(frozen=True)
class ShadingPipeline:
    """An interpolator, diffuse and specular terms of each light, and the intensity.

    The bit-true twin composes those of the devices; nothing is rounded in between. Formats and error bounds
    are theirs.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    model : str
        One of `MODELS`.
    lights : int
        Number of lights, 1 to 16.
    operand : str or None
        What the specular unit is given, ``"cosine"`` or ``"one_minus_cosine"``, for methods that find normals
        (see `golden.interpolator.NormalInterpolator`). ``None``: what the method gives by itself.
    materials : int
        Number of materials, 1 to `golden.frame_constants.MAX_MATERIALS`.

    Raises
    ------
    ValueError
        If the method, the model, the number of lights or materials or the operand is unknown, or the method
        has no choice of operand.
    """

    method: str = "quadratic"
    model: str = "cosquad"
    lights: int = 1
    operand: Operand | None = None
    materials: int = 1

    def __post_init__(self):
        if self.method not in METHODS:
            raise ValueError(f"method must be one of {', '.join(METHODS)}, not {self.method!r}")
        if self.model not in MODELS:
            raise ValueError(f"model must be one of {', '.join(MODELS)}, not {self.model!r}")
        if self.operand not in (None, METHODS[self.method].operand):
            if not isinstance(METHODS[self.method], NormalInterpolator):
                raise ValueError(f"method {self.method} finds no normals, and gives 1 - cos gamma")
            _ = self.interpolator
        Intensity(self.lights)
        if not 1 <= self.materials <= MAX_MATERIALS:
            raise ValueError(f"materials must be 1 to {MAX_MATERIALS}, not {self.materials}")

    @cached_property
    def interpolator(self) -> Interpolator:
        """Twin of the method."""
        interpolator = METHODS[self.method]
        if self.operand in (None, interpolator.operand):
            return interpolator
        return replace(interpolator, operand=self.operand)

    @property
    def highlight(self) -> Specular | Power:
        """Twin of the specular unit."""
        operand = self.interpolator.operand
        return Power(operand) if self.model == "blinn" else Specular(self.model, operand)

    def compute(self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]) -> Pixels:
        """Bit-true pixels, in the order of the spans.

        Parameters
        ----------
        spans : Spans
            What is shaded.
        constants : FrameConstants or sequence of FrameConstants
            Of the material, or of each; L and H are those of the first.

        Raises
        ------
        ValueError
            If a code is out of range, or the constants are for another number of lights or materials.
        """
        constants = [constants] if isinstance(constants, FrameConstants) else list(constants)
        if len(constants) != self.materials:
            raise ValueError(f"the constants are for {len(constants)} materials, not {self.materials}")
        for of_material in constants:
            if len(of_material.direction) != self.lights:
                given = len(of_material.direction)
                raise ValueError(f"the constants are for {given} lights, not {self.lights}")
        if len(spans) and not 0 <= spans.material.min() <= spans.material.max() < self.materials:
            raise ValueError(f"material must be 0 to {self.materials - 1}")
        for name in ("x", "y", "length"):
            codes = np.asarray(getattr(spans, name))
            if codes.size and not 0 <= codes.min() <= codes.max() <= _LARGEST_PLACE:
                raise ValueError(f"{name} must be 0 to {_LARGEST_PLACE}")
        kept = np.flatnonzero(np.asarray(spans.length) > 0)
        length = np.asarray(spans.length, dtype=np.int64)[kept]
        left, right = (Fixed(COMPONENT, codes[kept]) for codes in (spans.normal_left, spans.normal_right))
        direction, halfway = (Fixed(COMPONENT, v) for v in (constants[0].direction, constants[0].halfway))

        span, step = pixels_of(length)
        color = np.empty((len(span), 3), dtype=np.uint8)
        wide, done = 0, 0
        for part in _chunks(length):
            operands = self.interpolator.compute(left[part], right[part], length[part], direction, halfway)
            count = len(operands.cosine.codes)
            material = spans.material[kept][span[done : done + count]]
            for index in np.unique(material):
                which = np.flatnonzero(material == index)
                color[done + which] = self._shade(
                    operands.cosine[which], operands.highlight[which], constants[index]
                )
            wide, done = wide + int(np.count_nonzero(operands.wide)), done + count
        return Pixels(
            x=(np.asarray(spans.x)[kept][span] + step) & _LARGEST_PLACE,
            y=np.asarray(spans.y)[kept][span],
            color=color,
            last=step == length[span] - 1,
            wide_spans=wide,
        )

    def _shade(self, cosine: Fixed, highlight: Fixed, constants: FrameConstants) -> np.ndarray:
        diffuse_unit = Diffuse(cosine.format)
        dark = diffuse_unit.dark(cosine)
        diffuse = diffuse_unit.compute(cosine)
        specular = self.highlight.compute(highlight, dark, constants.exponent)
        colors = (constants.ambient, constants.diffuse, constants.specular)
        return Intensity(self.lights).compute(
            *(Fixed(Intensity.COLOR_FORMAT, codes) for codes in colors), diffuse, specular
        )


def _chunks(length: np.ndarray) -> Iterator[slice]:
    """Runs of spans with about `_CHUNK` pixels each; bounds the memory, changes no result."""
    ends = np.cumsum(length)
    start = 0
    while start < len(length):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + _CHUNK, side="right")), start + 1)
        yield slice(start, stop)
        start = stop
