"""The shading pipeline: spans in, pixels out; which methods and models there are, and the bit-true twin."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.frame_constants import MAX_MATERIALS, FrameConstants
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import FURTHER_MODELS, MAX_EXPONENT, SPECULAR_MODELS, Specular
from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import (
    Interpolator,
    NormalInterpolator,
    Operand,
    Operands,
    pixels_of,
    runs_of,
)
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator, SpanValues
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.difference_setup import LENGTH_BITS
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["METHODS", "MODELS", "PRINTED", "Pixels", "ShadingPipeline", "Spans"]

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
    "chord-local": LocalChordInterpolator(),
}
"""Interpolation methods of the pipeline."""

PRINTED: dict[str, Interpolator] = {
    "bisection-printed": BisectionInterpolator(bisection=Bisection(as_documented=True)),
    "quadratic-printed": QuadraticInterpolator(middle_normal=MiddleNormal("as_documented")),
    "angular-printed": AngularInterpolator(AngularSetup("arccos", Arccos("printed"))),
    "angular-corrected": AngularInterpolator(AngularSetup("arccos", Arccos("corrected"))),
    "recurrence-direct": RecurrenceInterpolator("direct"),
}
"""Methods with the coefficients or in the form that the documents print, to be compared with the others: the
polynomials of [T] 2.1 and 2.2, table 3.1 with its misprint and without, and formula 3.3 as it stands. A
gate does not go with them."""

MODELS = (*SPECULAR_MODELS, *FURTHER_MODELS, "blinn")
"""Reflection models of the pipeline; every method serves each."""

_ALL = METHODS | PRINTED


@dataclass(frozen=True)
class Spans:
    """The pipeline's input: raster spans with quantised normals.

    Parameters
    ----------
    x, y : int arrays, shape (spans,)
        First pixel of each span, 0 to 4095, or what the pipeline's coordinates hold.
    length : int array, shape (spans,)
        Pixels, 0 to 4095. A span of length 0 gives no pixel; one that goes past the largest x starts again
        at 0.
    normal_left, normal_right : int arrays, shape (spans, 3)
        Unit normals at the first and last pixel centre, codes of ``SQ(1, 17)``.
    material : int array, shape (spans,), optional
        Index of the material; ``None``: 0 for all.
    values : SpanValues, optional
        For ``chord-local``, which reads no normals: values of each light.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray
    material: np.ndarray | None = None
    values: SpanValues | None = None

    def __post_init__(self):
        if self.material is None:
            object.__setattr__(self, "material", np.zeros(len(self.length), dtype=np.int64))

    def __len__(self):
        return len(self.length)

    def __getitem__(self, which: slice | np.ndarray) -> "Spans":
        """Some of the spans, by a slice, indices or a mask."""
        values = self.values if self.values is None else SpanValues(*(codes[which] for codes in self.values))
        fields = ("x", "y", "length", "normal_left", "normal_right", "material")
        return Spans(*(getattr(self, name)[which] for name in fields), values)


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
        One of `METHODS` or `PRINTED`.
    model : str or None
        One of `MODELS`; ``None``: no specular light.
    lights : int
        Number of lights, 0 to 16. Without any there is ambient light alone, and no method.
    operand : str or None
        What the specular unit is given, ``"cosine"`` or ``"one_minus_cosine"``, for methods that find normals
        (see `NormalInterpolator`). ``None``: what the method gives by itself.
    materials : int
        Number of materials, 1 to `MAX_MATERIALS`.
    gate : bool
        Whether a `HighlightGate` tells the lights which spans have no highlight. For
        unit normals that changes no pixel.
    exponent : int or None
        A specular exponent for good; ``None``: that of the frame constants.
    grey : bool
        One channel in place of three: red's colour operands count, and the pixel has it three times.
    x_bits, y_bits, length_bits : int
        Bits of the coordinates, 1 to 12, and of a span's length, 2 to 12.
    terms, fraction_bits : int or None
        Of the chord method alone: terms of its polynomial, and bits of its differences, where they are to be
        fewer than those of `ChordSetup`.

    Raises
    ------
    ValueError
        If the method, the model, the number of lights or materials or the operand is unknown, the method has
        no choice of operand, a number of bits or the exponent is out of range, or a gate is asked for without
        specular light or with a method of `PRINTED`.
    """

    method: str = "quadratic"
    model: str | None = "cosquad"
    lights: int = 1
    operand: Operand | None = None
    materials: int = 1
    gate: bool = False
    exponent: int | None = None
    grey: bool = False
    x_bits: int = 12
    y_bits: int = 12
    length_bits: int = 12
    terms: int | None = None
    fraction_bits: int | None = None

    def __post_init__(self):
        if self.method not in _ALL:
            raise ValueError(f"method must be one of {', '.join(METHODS)}, not {self.method!r}")
        if self.model is not None and self.model not in MODELS:
            raise ValueError(f"model must be one of {', '.join(MODELS)}, not {self.model!r}")
        if self.operand not in (None, _ALL[self.method].operand):
            if not isinstance(_ALL[self.method], NormalInterpolator):
                raise ValueError(f"method {self.method} finds no normals, and gives 1 - cos gamma")
            _ = self.interpolator
        if self.method != "chord" and (self.terms, self.fraction_bits) != (None, None):
            raise ValueError(f"terms and fraction_bits are for the method chord, not {self.method}")
        _ = self.interpolator
        Intensity(self.lights)
        if not 1 <= self.materials <= MAX_MATERIALS:
            raise ValueError(f"materials must be 1 to {MAX_MATERIALS}, not {self.materials}")
        if self.gate and not (self.model and self.lights):
            raise ValueError("without specular light there is nothing to gate")
        if self.gate and not self.serves_gate:
            lacks = "normals" if self.takes_values else "error bound"
            raise ValueError(f"method {self.method} has no {lacks} for a gate")
        if self.exponent is not None and not 1 <= self.exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {self.exponent}")
        for name, least in (("x_bits", 1), ("y_bits", 1), ("length_bits", 2)):
            if not least <= getattr(self, name) <= LENGTH_BITS:
                raise ValueError(f"{name} must be {least} to {LENGTH_BITS}, not {getattr(self, name)}")

    @cached_property
    def interpolator(self) -> Interpolator:
        """Twin of the method."""
        interpolator = _ALL[self.method]
        changes = {"terms": self.terms, "fraction_bits": self.fraction_bits}
        if self.operand != interpolator.operand:
            changes["operand"] = self.operand
        return replace(interpolator, **{name: x for name, x in changes.items() if x is not None})

    @property
    def takes_values(self) -> bool:
        """Whether spans carry values of each light, in place of normals, so that L and H may be local."""
        return isinstance(self.interpolator, LocalChordInterpolator)

    @property
    def serves_gate(self) -> bool:
        """Whether a highlight gate can tell what the method's pixels will be."""
        return not self.takes_values and self.method not in PRINTED

    @property
    def highlight(self) -> Specular | Power | None:
        """Twin of the specular unit."""
        operand = self.interpolator.operand
        if self.model is None:
            return None
        return Power(operand) if self.model == "blinn" else Specular(self.model, operand)

    @cached_property
    def highlight_gate(self) -> HighlightGate:
        """Twin of the highlight gate."""
        return HighlightGate(self.highlight, interpolator=self.interpolator)

    def lit_spans(self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]) -> np.ndarray:
        """Which spans the highlight gate lets through, for each light: bool array, shape (spans, lights).

        Parameters
        ----------
        spans, constants
            As for `compute`.
        """
        constants = [constants] if isinstance(constants, FrameConstants) else constants
        left, right = (Fixed(COMPONENT, codes) for codes in (spans.normal_left, spans.normal_right))
        exponent = np.array([of_material.exponent for of_material in constants])[spans.material]
        lit = [
            self.highlight_gate.compute(left, right, Fixed(COMPONENT, halfway), exponent)
            for halfway in constants[0].halfway
        ]
        return np.stack(lit, axis=-1)

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
            If a code is out of range, the constants are for another number of lights or materials, or spans
            lack the values that the method takes.
        """
        constants = [constants] if isinstance(constants, FrameConstants) else list(constants)
        if len(constants) != self.materials:
            raise ValueError(f"the constants are for {len(constants)} materials, not {self.materials}")
        for of_material in constants:
            if len(of_material.direction) != self.lights:
                given = len(of_material.direction)
                raise ValueError(f"the constants are for {given} lights, not {self.lights}")
            if self.exponent not in (None, of_material.exponent):
                raise ValueError(f"the exponent is {self.exponent} for good, not {of_material.exponent}")
        if len(spans) and not 0 <= spans.material.min() <= spans.material.max() < self.materials:
            raise ValueError(f"material must be 0 to {self.materials - 1}")
        for name, bits in (("x", self.x_bits), ("y", self.y_bits), ("length", self.length_bits)):
            codes = np.asarray(getattr(spans, name))
            if codes.size and not 0 <= codes.min() <= codes.max() < 1 << bits:
                raise ValueError(f"{name} must be 0 to {(1 << bits) - 1}")
        kept = np.flatnonzero(np.asarray(spans.length) > 0)
        length = np.asarray(spans.length, dtype=np.int64)[kept]
        interpolate = self._interpolated(spans, kept, length, constants[0])

        span, step = pixels_of(length)
        color = np.empty((len(span), 3), dtype=np.uint8)
        wide, done = 0, 0
        lit = self.lit_spans(spans, constants)[kept] if self.gate else None
        for part in runs_of(length):
            if not self.lights:
                color[:] = self._ambient(constants, spans.material[kept][span])
                break
            operands = interpolate(part)
            count = len(operands.cosine.codes)
            of_pixel = span[done : done + count]
            material = spans.material[kept][of_pixel]
            dark = np.zeros((count, self.lights), dtype=bool) if lit is None else ~lit[of_pixel]
            for index in np.unique(material):
                which = np.flatnonzero(material == index)
                color[done + which] = self._shade(
                    operands.cosine[which], operands.highlight[which], dark[which], constants[index]
                )
            wide, done = wide + int(np.count_nonzero(operands.wide)), done + count
        return Pixels(
            x=(np.asarray(spans.x)[kept][span] + step) & ((1 << self.x_bits) - 1),
            y=np.asarray(spans.y)[kept][span],
            color=color,
            last=step == length[span] - 1,
            wide_spans=wide,
        )

    def _interpolated(self, spans, kept, length, constants) -> Callable[[slice], Operands]:
        """What takes a part of the spans that are kept to operands."""
        if self.takes_values and self.lights:
            if spans.values is None or spans.values.diffuse.shape != (len(spans), self.lights, 3):
                raise ValueError(f"method {self.method} takes spans with values for {self.lights} lights")
            values = [codes[kept] for codes in spans.values]
            return lambda part: self.interpolator.compute_values(
                SpanValues(*(codes[part] for codes in values)), length[part]
            )
        left, right = (Fixed(COMPONENT, codes[kept]) for codes in (spans.normal_left, spans.normal_right))
        vectors = [Fixed(COMPONENT, v) for v in (constants.direction, constants.halfway)]
        return lambda part: self.interpolator.compute(left[part], right[part], length[part], *vectors)

    def _shade(
        self, cosine: Fixed, highlight: Fixed, dark: np.ndarray, constants: FrameConstants
    ) -> np.ndarray:
        diffuse_unit = Diffuse(cosine.format)
        dark = dark | diffuse_unit.dark(cosine)
        diffuse = diffuse_unit.compute(cosine)
        specular = Fixed(Intensity.TERM_FORMAT, np.zeros(dark.shape, dtype=np.int64))
        if self.model is not None:
            specular = self.highlight.compute(highlight, dark, constants.exponent)
        return self.intensity.compute(*self._colors(constants), diffuse, specular)

    def _ambient(self, constants: Sequence[FrameConstants], material: np.ndarray) -> np.ndarray:
        """Colours of pixels of such materials without any light."""
        nothing = Fixed(Intensity.TERM_FORMAT, np.zeros((1, 0), dtype=np.int64))
        each = [self.intensity.compute(*self._colors(of), nothing, nothing) for of in constants]
        return np.concatenate(each)[material]

    @property
    def intensity(self) -> Intensity:
        """Twin of the intensity unit."""
        return Intensity(self.lights, has_specular=self.model is not None, channels=1 if self.grey else 3)

    def _colors(self, constants: FrameConstants) -> tuple[Fixed, ...]:
        colors = (constants.ambient, constants.diffuse, constants.specular)
        return tuple(Fixed(Intensity.COLOR_FORMAT, codes) for codes in colors)
