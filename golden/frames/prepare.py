"""The input of a pipeline for a frame: cut, ordered and quantised spans, and frame constants."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_spans, cutter_of
from blysk.golden.frames.local import line_ends, local_operands
from blysk.golden.frames.surface import check_albedo, span_attributes, with_albedo
from blysk.golden.frames.vector_axes import vector_axes
from blysk.golden.normals.line_setup import quantise_line
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.reference.faces import face_normals
from blysk.golden.reference.geometry import sum_of_components
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.scene import Scene

__all__ = [
    "PreparedFrame",
    "constants_of",
    "prepare",
    "quantise_spans",
    "sort_by_material",
    "span_vectors",
    "spans_for",
    "with_tables",
]


@dataclass(frozen=True)
class PreparedFrame:
    """Spans of a scene, before and after the steps that a pipeline needs, and its frame constants.

    Parameters
    ----------
    raster : Raster
        The rasteriser's spans.
    cut_raster : Raster
        The same fragments in spans that are narrow enough for the method, in the order of their materials.
    spans_cut : int
        Spans of ``raster`` that were cut, see `cut_spans`.
    spans : Spans
        Spans of ``cut_raster``, quantised: the pipeline's input.
    constants : list of FrameConstants
        Frame constants of each material, see `constants_of`.
    missed_spans : int
        Number of spans in which the method's curve is off by more than a quarter of an LSB. Only for methods
        whose spans are cut by their angle alone.
    """

    raster: Raster
    cut_raster: Raster
    spans_cut: int
    spans: Spans
    constants: list[FrameConstants]
    missed_spans: int = 0

    @property
    def writes(self) -> int:
        """Number of writes of frame constants."""
        return sum(len(of.writes()["data"]) for of in self.constants)


def prepare(scene: Scene, design: ShadingPipeline) -> PreparedFrame:
    """Rasterise a scene, and cut, order and quantise its spans for a pipeline.

    Raises
    ------
    ValueError
        If the scene has point lights or a near viewer, and the method does not serve them. If a light that
        fades has no factor in the design. If `constants_of` refuses the scene.
    """
    if scene.local and not design.interpolator.serves_local:
        raise ValueError("point lights and a near viewer need the method chord-local")
    if design.specular is not None:
        for index, light in enumerate(scene.lights):
            if light.fades and index not in design.factors:
                raise ValueError(f"light {index} fades, and the design has no factor for it: give factors")
    constants = constants_of(scene, design)
    raster = rasterise(scene)
    cut, count = cut_spans(scene, raster, design)
    cut = sort_by_material(cut, scene.mesh.material)
    missed = design.interpolator.missed(cutter_of(scene, raster, design), cut)
    return PreparedFrame(raster, cut, count, spans_for(scene, cut, design), constants, missed)


def spans_for(scene: Scene, cut: Raster, design: ShadingPipeline) -> Spans:
    """The input beats of a pipeline for spans that are cut for it, with the operands of the method.

    Parameters
    ----------
    scene : Scene
        Materials, lights and viewer.
    cut : Raster
        Spans from `cut_spans`.
    design : ShadingPipeline
        The pipeline.
    """
    spans = design.interpolator.filled(_Filler(scene, cut, design))
    if design.albedo is None:
        return spans
    return replace(spans, attributes=span_attributes(scene, cut, design.albedo))


@dataclass(frozen=True)
class _Filler:
    """Fills the beats of cut spans for a design, see `SpanFiller`."""

    scene: Scene
    cut: Raster
    design: ShadingPipeline

    def with_normals(self) -> Spans:
        return quantise_spans(self.cut, self.scene.mesh.material)

    def _with_ends(self, left: np.ndarray, right: np.ndarray) -> Spans:
        cut = self.cut
        return Spans(cut.x, cut.y, cut.length, left, right, self.scene.mesh.material[cut.triangle])

    def _without_ends(self) -> Spans:
        none = np.broadcast_to(np.int64(0), (len(self.cut.length), 3))
        return self._with_ends(none, none)

    def with_lines(self) -> Spans:
        return self._with_ends(*quantise_line(*_true_ends(self.scene, self.cut)))

    def with_values(self) -> Spans:
        design = self.design
        of = design.lights, design.factors, design.interpolator.scale
        values, factors = local_operands(self.scene, self.cut, *of)
        return replace(self._without_ends(), values=values, factors=factors)

    def with_vectors(self) -> Spans:
        if not self.design.lights:
            return self.with_normals()
        return replace(self._without_ends(), vectors=span_vectors(self.scene, self.cut, self.design))


def _true_ends(scene: Scene, cut: Raster) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the true line. If both are 0, they become the face's normal, see `fragment_normals`."""
    left, right = line_ends(cut)
    lost = np.ones(len(left), dtype=bool)
    for end, weights in ((left, cut.weights_left), (right, cut.weights_right)):
        lost &= np.sqrt(sum_of_components(end * end)) <= 1e-12 * sum_of_components(weights)
    if lost.any():
        triangle = cut.triangle[lost]
        face = face_normals(scene.mesh)[triangle]
        flip = cut.back[lost] & scene.flips[triangle]
        left[lost] = right[lost] = np.where(flip[:, np.newaxis], -face, face)
    return left, right


def span_vectors(scene: Scene, cut: Raster, design: ShadingPipeline) -> SpanVectors:
    """Vectors ``N/W`` of spans in the frames of the lights, quantised, for a method that takes them.

    Parameters
    ----------
    scene : Scene
        Lights and viewer.
    cut : Raster
        Spans from `cut_spans`.
    design : ShadingPipeline
        The pipeline.
    """
    axes = vector_axes(scene, design)
    # Sums of columns have equal bits on every machine, and take less time than a product of matrices.
    left, right = (
        np.stack([x * axis[0] + y * axis[1] + z * axis[2] for axis in axes], axis=1)
        for x, y, z in (end.T for end in _true_ends(scene, cut))
    )
    return SpanVectors.quantise(left, right, cut.length)


def constants_of(scene: Scene, design: ShadingPipeline) -> list[FrameConstants]:
    """Frame constants of each material of a scene, for a pipeline.

    Raises
    ------
    ValueError
        If the scene has more lights or another number of materials than the design, or more lobes than banks.
        If a term is brighter than 8. If the design does not show the colours of the surface.
    """
    check_albedo(scene, design)
    if len(scene.materials) != design.materials:
        raise ValueError(f"the pipeline has {design.materials} materials, the scene {len(scene.materials)}")
    constants = [
        FrameConstants.of(scene, design.lights, index=index, mirror=design.mirror)
        for index in range(design.materials)
    ]
    constants = design.interpolator.constants_for(scene, constants)
    if design.albedo is not None:
        constants = with_albedo(constants, scene, design)
    return with_tables(constants, scene.materials, design) if design.loads_tables else constants


def with_tables(
    constants: Sequence[FrameConstants], materials: Sequence[Material], design: ShadingPipeline
) -> list[FrameConstants]:
    """Frame constants with the tables of the materials' lobes. Equal tables share a bank.

    Parameters
    ----------
    constants : sequence of FrameConstants
        Constants of each material.
    materials : sequence of Material
        The materials, in the same order.
    design : ShadingPipeline
        Pipeline whose specular unit is a `Lobe`.

    Raises
    ------
    ValueError
        If the materials have more lobes than banks, or a lobe that is not among the lobes fixed at build
        time.
    """
    lobe = design.lobe
    parameters = [material.parameter(lobe.reflection) for material in materials]
    banks = list(lobe.fixed or dict.fromkeys(parameters))
    for parameter in parameters:
        if parameter not in banks:
            fixed = ", ".join(f"{value:g}" for value in banks)
            raise ValueError(f"the {lobe.reflection.PARAMETER} is fixed at {fixed}, not {parameter:g}")
    if len(banks) > lobe.banks:
        most = f"build it with more banks, up to {lobe.MAX_BANKS}"
        if lobe.banks == lobe.MAX_BANKS:
            most = "take a model without a table, such as exp"
        raise ValueError(
            f"the materials have {len(banks)} lobes, the pipeline has banks for {lobe.banks}; give materials "
            f"an equal {lobe.reflection.PARAMETER}, or {most}"
        )
    tables = [lobe.table(parameter) for parameter in banks]
    thresholds = [
        design.threshold_of(table).codes.item() if design.has_threshold else None for table in tables
    ]
    chosen = map(banks.index, parameters)
    return [
        replace(of_material, lobe=tables[bank], bank=bank, threshold=thresholds[bank])
        for of_material, bank in zip(constants, chosen, strict=True)
    ]


def sort_by_material(raster: Raster, material: np.ndarray) -> Raster:
    """The same spans and fragments, sorted by material.

    Parameters
    ----------
    raster : Raster
        Spans.
    material : int array
        Material of each triangle.
    """
    of_span = material[raster.triangle]
    if not np.any(of_span[1:] < of_span[:-1]):
        return raster
    spans = np.argsort(of_span, kind="stable")
    place = np.empty_like(spans)
    place[spans] = np.arange(len(spans))
    fragments = np.argsort(place[raster.span], kind="stable")
    by_span = ["x", "y", "length", "triangle", "normal_left", "normal_right", "back"]
    by_span += ["magnitude_left", "magnitude_right", "weights_left", "weights_right", "level"]
    kept = {name: getattr(raster, name) for name in by_span}
    moved = {name: values[spans] if len(values) else values for name, values in kept.items()}
    moved |= {name: getattr(raster, name)[fragments] for name in ("offset", "pixel", "visible")}
    return replace(raster, **moved, span=place[raster.span][fragments].astype(raster.span.dtype))


def quantise_spans(raster: Raster, material: np.ndarray) -> Spans:
    """The pipeline's input beats for a raster, normals in codes of ``SQ(1, 17)``.

    Parameters
    ----------
    raster : Raster
        Spans.
    material : int array
        Material of each triangle.
    """
    return Spans(
        x=raster.x,
        y=raster.y,
        length=raster.length,
        normal_left=quantise(raster.normal_left),
        normal_right=quantise(raster.normal_right),
        material=material[raster.triangle],
    )
