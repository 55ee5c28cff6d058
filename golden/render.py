"""From triangles to pixels: the bit-accurate model of geometry, shading and depth test."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from blysk.golden.build import BuildError
from blysk.golden.frame_constants import FrameConstants, by_material
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.geometry.depth_lanes import DepthLanes
from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.geometry.edge_normals import TrueSpans
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.mirror_adapter import MirrorAdapter
from blysk.golden.geometry.span_adapter import LineSpans, shading_spans
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.golden.geometry.vertex_sort import TESTED
from blysk.golden.pipeline import ShadingPipeline

__all__ = ["DrawnPixels", "Renderer"]

_OF_THE_METHOD = Geometry()
"""Default of `Renderer.geometry`: it stands for the geometry that suits the design's method."""


@dataclass(frozen=True)
class DrawnPixels:
    """Pixels in the order of drawing. A nearer pixel may overwrite a pixel later.

    Parameters
    ----------
    x, y : int64 arrays, shape (P,)
        Column and row, counted from the picture's top left pixel.
    color : uint8 array, shape (P, 3)
        Red, green, blue.
    depth : int64 array, shape (P,)
        0 to 2^24 - 2.
    triangle : int64 array, shape (P,)
        Index of the triangle.
    spans : TrueSpans, LineSpans or VectorSpans
        The shaded spans.
    counts : dict of str to int
        `COUNTERS` of geometry; numbers of shaded ``spans`` and ``pixels``; number of ``hidden`` pixels among
        them; number of pixels of spans ``dropped`` before shading.
    out_of_range_spans : int
        Number of spans with a larger angle than the method serves.
    lanes : int
        Pixels of a beat.
    beat, lane : int64 arrays, shape (P,), optional
        Index of each pixel's beat, and the pixel's lane. Only with several lanes.
    """

    x: np.ndarray
    y: np.ndarray
    color: np.ndarray
    depth: np.ndarray
    triangle: np.ndarray
    spans: TrueSpans | LineSpans | VectorSpans
    counts: dict[str, int]
    out_of_range_spans: int
    lanes: int = 1
    beat: np.ndarray | None = None
    lane: np.ndarray | None = None

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Output beats of the hardware: the fields of each pixel, or of the pixels of all lanes."""
        colors = dict(zip("rgb", self.color.T, strict=True))
        if self.beat is None or self.lane is None:
            return {"x": self.x, "y": self.y, **colors, "depth": self.depth}
        first = np.flatnonzero(np.r_[True, self.beat[1:] != self.beat[:-1]][: len(self.beat)])
        shape = len(first), self.lanes
        channels = np.zeros(shape, [(name, np.uint8) for name in "rgb"])
        for name, channel in colors.items():
            channels[name][self.beat, self.lane] = channel
        present, depths = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
        present[self.beat, self.lane], depths[self.beat, self.lane] = 1, self.depth
        return {
            "x": (self.x - self.lane)[first],
            "y": self.y[first],
            "present": (present << np.arange(self.lanes)).sum(axis=1),
            "colors": channels,
            "depths": depths,
        }


@dataclass(frozen=True)
class Renderer:
    """Bit-accurate model of the way from triangles to pixels.

    Parameters
    ----------
    design : ShadingPipeline
        The shading pipeline, of a method that takes normals or vectors. If its `Build` has a coarse depth
        test, the test drops a span before shading if all of its pixels are hidden. The picture is the same.
    geometry : Geometry
        The part that makes spans of triangles. It has ``lines`` for a method that takes true lines. It has
        ``vectors`` for a method that takes vectors, and with several lights ``rotates``, too. By default the
        geometry suits the method.

    Raises
    ------
    ValueError
        In one of these cases:

        - the method takes values, or other words than the geometry gives;
        - the design has an albedo, and the method takes no vectors;
        - the design has an albedo, and several lanes of triangle setup;
        - the albedo has no 1/W, or its texels are outside.

    Source: docs/theory/geometry.md#composition; [T] figure 4.10.
    """

    design: ShadingPipeline = field(default_factory=ShadingPipeline)
    geometry: Geometry = _OF_THE_METHOD

    def __post_init__(self) -> None:
        suits = self._suits()
        if self.geometry is _OF_THE_METHOD:
            object.__setattr__(self, "geometry", suits)
        if self.geometry.surface != suits.surface:
            raise ValueError("the geometry gives other attributes of the surface than the design takes")
        if self.geometry.gives != suits.gives:
            taken, given = suits.gives, self.geometry.gives
            raise ValueError(f"method {self.design.method} takes {taken}, the geometry gives {given}")
        tested = 0 if self.design.build.compact_geometry else TESTED
        object.__setattr__(self, "geometry", replace(self.geometry, tested=tested))

    def _suits(self) -> Geometry:
        """The geometry for the method and the albedo of the design."""
        found, albedo = self.design.interpolator.geometry(self.design.lights), self.design.albedo
        if albedo is None:
            return found
        if not found.vectors:
            raise ValueError(
                f"hardware geometry has no vertex colours and no textures for method {self.design.method}; "
                "use quotient"
            )
        if self.design.build.setups > 1:
            reason = "vertex colours and textures take one lane of triangle setup"
            raise BuildError("setups", reason, "leave out setups")
        if not albedo.perspective:
            raise BuildError("albedo", "hardware geometry gives 1/W of every pixel", "leave out orthographic")
        if albedo.texture is not None and albedo.texture.memory.external:
            raise BuildError("albedo", "hardware geometry needs its texels inside", "leave out outside")
        return replace(found, surface=albedo.spans)

    @property
    def coarse(self) -> CoarseDepth | None:
        """The coarse depth test, if there is one."""
        return self.design.build.coarse

    @property
    def mirrors(self) -> bool:
        """Whether `MirrorAdapter` adds the components of R·V to the vectors of geometry."""
        return self.design.mirror and self.design.lights > 0

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes of a further light's frame by which `LightAdapter` makes components; empty with one light."""
        if not self.geometry.rotates:
            return ()
        return ("x", "y cos a" if self.mirrors else "y", "z") if self.design.specular else ("z",)

    @property
    def rows(self) -> int:
        """Number of components that `LightAdapter` adds to a vector, for all further lights."""
        return len(self.axes) * (self.design.lights - 1)

    def compute(
        self, triangles: Triangles, frame: FrameSettings, constants: FrameConstants | Sequence[FrameConstants]
    ) -> DrawnPixels:
        """Bit-accurate pixels.

        Parameters
        ----------
        triangles : Triangles
            In the order of drawing.
        frame : FrameSettings
            The picture.
        constants : FrameConstants or sequence of FrameConstants
            As for `ShadingPipeline.compute`; with several lights and vectors they have axes, as
            `triangle_frame.triangle_constants` gives them.

        Raises
        ------
        ValueError
            If the constants lack the axes of further lights, or do not suit the design.
        """
        spans, counts = self.geometry.compute(triangles, frame)
        dropped = 0
        if self.coarse is not None:
            places = (spans.x, spans.y, spans.length, spans.depth, spans.depth_step)
            hidden = self.coarse.compute(*places)
            dropped = int(spans.length[hidden].sum())
            fields = {name: value for name, value in vars(spans).items() if value is not None}
            spans = replace(spans, **{name: value[~hidden] for name, value in fields.items()})
        spans = self._for_lights(spans, by_material(constants)[0])
        pixels = self.design.compute(shading_spans(spans), constants)
        test = DepthTester()
        depth = test.depths(spans.length, spans.depth, spans.depth_step)
        x, y = (np.asarray(place, dtype=np.int64) for place in (pixels.x, pixels.y))
        drawn = test.drawn((y << self.design.x_bits) + x, depth)
        return DrawnPixels(
            x=x[drawn],
            y=y[drawn],
            color=pixels.color[drawn],
            depth=depth[drawn],
            triangle=np.repeat(spans.triangle, spans.length)[drawn],
            spans=spans,
            counts=counts
            | {"spans": len(spans), "pixels": len(drawn), "hidden": int((~drawn).sum())}
            | {"dropped": dropped},
            out_of_range_spans=pixels.out_of_range_spans,
            **self._lanes(spans.length, drawn),
        )

    def _lanes(self, length: np.ndarray, drawn: np.ndarray) -> dict[str, Any]:
        """Fields of `DrawnPixels` for several lanes, from the spans' lengths and which pixels are drawn."""
        lanes = self.design.build.lanes
        if lanes == 1:
            return {}
        beat, lane = DepthLanes(lanes).beats(length, drawn)
        return {"lanes": lanes, "beat": beat, "lane": lane}

    def _for_lights(
        self, spans: TrueSpans | LineSpans | VectorSpans, constants: FrameConstants
    ) -> TrueSpans | LineSpans | VectorSpans:
        """Vectors with the components of further lights and of highlights of R·V; other spans unchanged."""
        if not isinstance(spans, VectorSpans):
            return spans
        if self.rows:
            axes = constants.axes
            if axes is None or axes.shape[0] * axes.shape[1] != self.rows:
                raise ValueError(f"the constants must have {self.rows} axes of further lights")
            spans = LightAdapter().compute(spans, axes.reshape(-1, 3))
        if self.mirrors:
            sine, _, cosine = constants.direction[0]
            spans = MirrorAdapter().compute(spans, sine, cosine)
        return spans
