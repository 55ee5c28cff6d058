"""The shading pipeline: the composition of a design, and its bit-accurate model."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.beats import Pixels, Spans
from blysk.golden.build import Build, BuildError
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.frame_constants import MAX_MATERIALS, FrameConstants, by_material
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.factor import Factor
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.golden.lighting.transfer import Transfer
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.methods.quotient_interpolator import QuotientInterpolator
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.spans import LENGTH_BITS, pixels_of, runs_of
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.transfer import TRANSFERS

__all__ = ["Pixels", "ShadingPipeline", "Spans"]


@dataclass(frozen=True)
class ShadingPipeline:
    """A shading pipeline: an interpolator, diffuse and specular terms of each light, and the intensity.

    `presets.preset` makes a design by names. `compute`, the bit-accurate model, composes the models of the
    units, with their formats and error bounds; nothing is rounded between units.

    Parameters
    ----------
    interpolator : Interpolator
        The method.
    specular : HighlightOperand or None
        Specular unit; it takes the operand that the interpolator gives. ``None``: no specular light.
    lights : int
        Number of lights, 0 to 16. Without lights there is only ambient light, and no method.
    materials : int
        Number of materials, 1 to `frame_constants.MAX_MATERIALS`.
    gate : bool
        Whether a gate decides which spans have no highlight; it changes no pixel. Methods of
        unit normals have a `HighlightGate`.
    grey : bool
        Whether there is one channel in place of three. It uses the colour operands of red, and the pixel
        repeats it three times.
    x_bits, y_bits, length_bits : int
        Bits of the coordinates (1 to 12), and of a span's length (2 to 12).
    factors : tuple of int
        Indices, in ascending order, of the lights that fade by their distance or as a spot. A factor
        multiplies the specular term of its light. The method must take values, and there must be specular
        light. Other lights need no hardware for a factor.
    albedo : Albedo or None
        Albedo path: vertex colours and textures give each pixel a colour of the surface. ``None``: no albedo.
    transfer : str
        Codes of the pixels: ``"linear"`` light, or encoded by the curve of ``"srgb"``, see `Transfer`.
    build : Build
        Build options.

    Raises
    ------
    ValueError
        In one of these cases:

        - the number of lights or materials or a number of bits is out of range;
        - there is a gate, but no specular light, or the method has no error bound for a gate;
        - an exponent is fixed with a lobe;
        - a lobe takes 1 - N·H with other than 25 fraction bits;
        - the method has a scale, but there is no lobe;
        - factors do not name different lights in ascending order;
        - there are factors, but no specular light, or the method takes no values;
        - the transfer is unknown;
        - the albedo has tints, but there is no specular light;
        - texels are outside of several pipelines, or of a core on a bus (a `BuildError`);
        - there are several lanes, and an albedo, or a method of single pixels (a `BuildError`).

    Source: docs/theory/units.md#pipeline; [T] figure 4.10.
    """

    interpolator: Interpolator = field(default_factory=QuotientInterpolator)
    specular: HighlightOperand | None = field(default_factory=Lobe)
    lights: int = 1
    materials: int = 1
    gate: bool = False
    grey: bool = False
    x_bits: int = 12
    y_bits: int = 12
    length_bits: int = 12
    factors: tuple[int, ...] = ()
    albedo: Albedo | None = None
    transfer: str = "linear"
    build: Build = field(default_factory=Build)

    def __post_init__(self) -> None:
        method = self.interpolator.matched(self.specular).for_lanes(self.build.lanes, self.build.pairs)
        object.__setattr__(self, "interpolator", method)
        object.__setattr__(self, "specular", self.specular and method.unit_for(self.specular))
        Intensity(self.lights)
        if not 1 <= self.materials <= MAX_MATERIALS:
            raise ValueError(f"materials must be 1 to {MAX_MATERIALS}, not {self.materials}")
        if self.loads_tables:
            self._check_lobe()
        if self.gate and not self.has_highlights:
            raise ValueError("without specular light there is nothing to gate")
        if self.gate and not self.interpolator.serves_gate:
            raise ValueError(f"method {self.method} has no error bound for a gate")
        for name, least in (("x_bits", 1), ("y_bits", 1), ("length_bits", 2)):
            if not least <= getattr(self, name) <= LENGTH_BITS:
                raise ValueError(f"{name} must be {least} to {LENGTH_BITS}, not {getattr(self, name)}")
        if self.transfer not in TRANSFERS:
            raise ValueError(f"transfer must be one of {', '.join(TRANSFERS)}, not {self.transfer!r}")
        if self.albedo is not None and self.albedo.tints and not self.has_highlights:
            raise ValueError("an albedo with tints needs specular light")
        if self.build.lanes > 1:
            self._check_lanes()
        if self.texels_outside and (self.build.pipes > 1 or self.build.bus != "native"):
            option = "pipes" if self.build.pipes > 1 else "bus"
            remedy = f"leave out {option}, or take a texel memory inside"
            raise BuildError(option, "only a single native core has texels outside", remedy)
        object.__setattr__(self, "factors", tuple(self.factors))
        if self.factors:
            self._check_factors()

    def _check_lanes(self) -> None:
        """Refuse parts that serve one pixel a cycle."""
        if self.albedo is not None:
            raise BuildError("lanes", "an albedo comes pixel by pixel", "leave out lanes or the albedo")

    def _check_factors(self) -> None:
        """Refuse factors of lights that do not exist, and factors that no unit of the design takes."""
        if not (self.interpolator.serves_local and self.specular):
            raise ValueError("factors of lights need the method chord-local, and specular light")
        if list(self.factors) != sorted(set(self.factors) & set(range(self.lights))):
            raise ValueError(f"factors must be different lights of {self.lights}, in order")

    def _check_lobe(self) -> None:
        """Refuse options that do not go with the tables of a lobe."""
        if self.build.exponent is not None:
            raise ValueError("a lobe has tables and no exponent; fix its tables")
        lobe = self.lobe
        if lobe.operand == "one_minus_cosine" and lobe.fraction_bits != 25:
            raise ValueError(f"1 - N·H has 25 fraction bits in a pipeline, the lobe {lobe.fraction_bits}")

    @property
    def loads_tables(self) -> bool:
        """Whether the specular unit has tables of a lobe, so that the frame constants need tables."""
        return self.specular is not None and self.specular.has_table

    def highlight_parameter(self, material: Material) -> float | None:
        """Exponent or roughness of a material, as the model takes it; the exponent without a model."""
        return material.parameter(self.specular.reflection) if self.specular else material.exponent

    def steepness(self, material: Material) -> float:
        """Exponent that decides how fine spans must be, see `ReflectionModel.steepness`."""
        if self.specular is None:
            return material.exponent
        return self.specular.reflection.steepness(self.highlight_parameter(material))

    def for_materials(self, materials: Sequence[Material], scaled: bool = True) -> "ShadingPipeline":
        """The same design for the materials of a scene.

        The lobe has a bank for each different table, at most `Lobe.MAX_BANKS`, and as many steps as the
        tables need.

        Parameters
        ----------
        materials : sequence of Material
            Materials of the scene.
        scaled : bool
            Whether ``chord-local`` may have a scale for sharp lobes, see `Lobe.scale_of`. The spans then have
            to be cut for this design.
        """
        specular, interpolator = self.specular, self.interpolator
        if self.loads_tables and self.lobe.fixed is None:
            lobes = list(dict.fromkeys(map(self.highlight_parameter, materials)))
            lobe = replace(self.lobe, banks=min(len(lobes), Lobe.MAX_BANKS)).for_parameters(lobes)
            specular, interpolator = lobe, interpolator.fitted(lobe, lobes) if scaled else interpolator
        return replace(self, materials=len(materials), specular=specular, interpolator=interpolator)

    def built(self, **changes: Any) -> "ShadingPipeline":
        """The same design with other values of its `Build`."""
        return replace(self, build=replace(self.build, **changes))

    @property
    def texels_outside(self) -> bool:
        """Whether textures are in a memory outside of the pipeline."""
        texture = None if self.albedo is None else self.albedo.texture
        return texture is not None and texture.memory.external

    @property
    def lobe(self) -> Lobe:
        """The specular unit of a design that `loads_tables`."""
        return cast(Lobe, self.specular)

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.interpolator.name

    @property
    def model(self) -> str | None:
        """Name of the reflection model; ``None`` without specular light."""
        return self.specular.name if self.specular else None

    @property
    def has_highlights(self) -> bool:
        """Whether a pixel has specular light: there are a reflection model and a light."""
        return self.specular is not None and self.lights > 0

    @property
    def mirror(self) -> bool:
        """Whether the highlight is of R·V in place of N·H."""
        return self.specular is not None and self.specular.reflection.MIRROR

    @property
    def vector_spans(self) -> QuotientSpans:
        """Model of the setup of a method that takes vectors."""
        return self.interpolator.spans(self.lights, self.specular is not None)

    @cached_property
    def highlight_gate(self) -> Gate:
        """Bit-accurate model of the gate."""
        assert self.specular is not None
        return self.interpolator.gate(self.specular)

    @property
    def has_threshold(self) -> bool:
        """Whether frame constants have a threshold: tables are loaded, and the gate needs a threshold."""
        return self.loads_tables and self.gate

    @property
    def banks(self) -> int:
        """Number of tables of lobes; 0 without a lobe."""
        return self.specular.banks if self.specular is not None else 0

    @property
    def threshold_format(self) -> Format | None:
        """Format of the threshold in the frame constants; ``None`` without a threshold."""
        return self.highlight_gate.threshold_format if self.has_threshold else None

    def threshold_of(self, table: LobeTable) -> Fixed:
        """The highlight gate's threshold for a table."""
        return self.highlight_gate.thresholds_of(np.array([table.last_lit_argument]))[0]

    def lit_spans(self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]) -> np.ndarray:
        """Spans that may have a highlight of each light, as the highlight gate decides.

        Parameters
        ----------
        spans, constants
            As for `compute`.

        Returns
        -------
        bool array, shape (spans, lights)
        """
        each, gate = by_material(constants), self.highlight_gate
        if self.loads_tables:
            arguments = np.array([of_material.table.last_lit_argument for of_material in each])
            threshold = gate.thresholds_of(arguments)[spans.material]
        else:
            threshold = gate.thresholds_at(np.array([of.exponent for of in each])[spans.material])
        return gate.lit(spans, each[0].halfway, threshold)

    def compute(self, spans: Spans, constants: FrameConstants | Sequence[FrameConstants]) -> Pixels:
        """Bit-accurate pixels, in the order of the spans.

        Parameters
        ----------
        spans : Spans
            Spans to shade.
        constants : FrameConstants or sequence of FrameConstants
            Constants of the only material, or of each material. L and H come from the first.

        Raises
        ------
        ValueError
            If a code is out of range, or spans lack the values that the method takes. If the constants are
            for another number of lights or materials.
        """
        constants = by_material(constants)
        self._check(spans, constants)
        kept = np.flatnonzero(np.asarray(spans.length) > 0)
        length = np.asarray(spans.length, dtype=np.int64)[kept]
        span, step = pixels_of(length)
        color = np.empty((len(span), 3), dtype=np.int64)
        out_of_range = 0
        if self.lights or self.albedo:
            lit = self.lit_spans(spans, constants)[kept] if self.gate else None
            shown, first = replace(spans[kept], length=length), 0
            for part in runs_of(length):
                operands = self._operands(shown[part], constants[0])
                pixels = slice(first, first + len(operands.cosine.codes))
                albedo = self._albedo_of(shown[part], constants)
                material = spans.material[kept][span[pixels]]
                dark = np.zeros(operands.cosine.shape, dtype=bool) if lit is None else ~lit[span[pixels]]
                for index in np.unique(material):
                    which = np.flatnonzero(material == index)
                    terms = operands.cosine[which], operands.highlight[which], dark[which]
                    factor = operands.factor[which] if operands.factor is not None else None
                    own = albedo[which] if albedo is not None else None
                    color[pixels][which] = self._shade(*terms, constants[index], factor, own)
                out_of_range += int(np.count_nonzero(operands.out_of_range))
                first = pixels.stop
        else:
            color[:] = self._ambient(constants, spans.material[kept][span])
        return Pixels(
            x=(np.asarray(spans.x)[kept][span] + step) & ((1 << self.x_bits) - 1),
            y=np.asarray(spans.y)[kept][span],
            color=self._encoded(color),
            last=step == length[span] - 1,
            out_of_range_spans=out_of_range,
        )

    def _check(self, spans: Spans, constants: Sequence[FrameConstants]) -> None:
        """Refuse constants of another design, and codes out of range."""
        if len(constants) != self.materials:
            raise ValueError(f"the constants are for {len(constants)} materials, not {self.materials}")
        for of_material in constants:
            if len(of_material.direction) != self.lights:
                given = len(of_material.direction)
                raise ValueError(f"the constants are for {given} lights, not {self.lights}")
            if self.specular is not None:
                self.specular.check(of_material.lobe)
            if self.build.exponent not in (None, of_material.exponent):
                fixed = self.build.exponent
                raise ValueError(f"the exponent is fixed at {fixed}, not {of_material.exponent}")
        if len(spans) and not 0 <= spans.material.min() <= spans.material.max() < self.materials:
            raise ValueError(f"material must be 0 to {self.materials - 1}")
        for name, bits in (("x", self.x_bits), ("y", self.y_bits), ("length", self.length_bits)):
            codes = np.asarray(getattr(spans, name))
            if codes.size and not 0 <= codes.min() <= codes.max() < 1 << bits:
                raise ValueError(f"{name} must be 0 to {(1 << bits) - 1}")
        if self.lights:
            self.interpolator.check(spans, self.lights, len(self.factors))
        if (spans.attributes is None) != (self.albedo is None):
            has, lack = ("no", "have") if self.albedo is None else ("an", "lack")
            raise ValueError(f"the design has {has} albedo, and the spans {lack} attributes")

    def sent(self, spans: Spans, constants: Sequence[FrameConstants]) -> Spans:
        """Spans as the hardware takes them, see `Interpolator.sent`."""
        return self.interpolator.sent(spans, constants, self.specular is not None)

    def operands(self, spans: Spans, constants: FrameConstants) -> Operands:
        """Bit-accurate operands of every pixel of spans, each of one pixel or more, in their order."""
        return self.interpolator.operands(spans, constants, self.specular is not None)

    def _shade(
        self,
        cosine: Fixed,
        highlight: Fixed,
        dark: np.ndarray,
        constants: FrameConstants,
        factor: Fixed | None = None,
        albedo: Fixed | None = None,
    ) -> np.ndarray:
        """Codes of `intensity` for pixels of one material, from operands of shape (pixels, lights)."""
        diffuse_unit = Diffuse(cosine.format)
        dark = dark | diffuse_unit.dark(cosine)
        diffuse = diffuse_unit.compute(cosine)
        specular = Fixed(Intensity.TERM_FORMAT, np.zeros(dark.shape, dtype=np.int64))
        if self.specular is not None and self.lights:
            specular = self.specular.compute(highlight, dark, constants.highlight)
        if factor is not None:
            codes = specular.codes.copy()
            fading = list(self.factors)
            codes[:, fading] = Factor().compute(specular[:, fading], factor).codes
            specular = Fixed(specular.format, codes)
        colors = self._colors(constants)
        if albedo is None:
            return self.intensity.compute(*colors, diffuse, specular)
        emission = np.zeros(3, dtype=np.int64) if constants.emission is None else constants.emission
        colored = albedo, Fixed(Intensity.COLOR_FORMAT, emission), bool(constants.tinted)
        return self.intensity.compute(*colors, diffuse, specular, *colored)

    def _operands(self, spans: Spans, constants: FrameConstants) -> Operands:
        """Operands of every pixel. Without lights they are empty: shape (pixels, 0)."""
        if self.lights:
            return self.operands(spans, constants)
        none = Fixed(Intensity.TERM_FORMAT, np.zeros((int(spans.length.sum()), 0), dtype=np.int64))
        return Operands(none, none, np.zeros(0, dtype=bool))

    def _albedo_of(self, spans: Spans, constants: Sequence[FrameConstants]) -> Fixed | None:
        """Albedo of every pixel, for spans of at least one pixel; ``None`` without albedo."""
        if self.albedo is None or spans.attributes is None:
            return None
        textures = [of.texture for of in constants if of.texture is not None]
        given = spans.attributes, spans.length, spans.material, textures, constants[0].texels
        return self.albedo.compute(*given)

    def _ambient(self, constants: Sequence[FrameConstants], material: np.ndarray) -> np.ndarray:
        """Codes of `intensity` for pixels by their materials, without any light."""
        nothing = Fixed(Intensity.TERM_FORMAT, np.zeros((1, 0), dtype=np.int64))
        each = [self.intensity.compute(*self._colors(of), nothing, nothing) for of in constants]
        color: np.ndarray = np.concatenate(each)[material]
        return color

    def _encoded(self, color: np.ndarray) -> np.ndarray:
        """Codes of pixels from the codes of `intensity`."""
        if self.transfer == "linear":
            return color.astype(np.uint8)
        return Transfer().compute(Fixed(Transfer.OPERAND_FORMAT, color))

    @property
    def intensity(self) -> Intensity:
        """Bit-accurate model of the intensity unit."""
        return Intensity(
            self.lights,
            has_specular=self.specular is not None,
            channels=1 if self.grey else 3,
            has_albedo=self.albedo is not None,
            tints=self.albedo is not None and self.albedo.tints,
            fraction_bits=0 if self.transfer == "linear" else Transfer.OPERAND_FORMAT.fraction_bits,
        )

    @staticmethod
    def _colors(constants: FrameConstants) -> tuple[Fixed, Fixed, Fixed]:
        """Ambient, diffuse and specular colour operands."""
        colors = (constants.ambient, constants.diffuse, constants.specular)
        ambient, diffuse, specular = (Fixed(Intensity.COLOR_FORMAT, codes) for codes in colors)
        return ambient, diffuse, specular
