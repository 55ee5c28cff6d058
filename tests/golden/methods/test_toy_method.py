"""A method from outside the package, by its own class alone, goes through a frame of the model."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from blysk.golden.frames.compare import compare, error_bound
from blysk.golden.frames.frame import model_frame
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import COSQUAD

from ..frames.test_compare import facing


class NoGate(Gate):
    """A gate that lets every span pass."""

    threshold_format = UQ(1, 0)

    def thresholds_at(self, exponent):
        """Thresholds without a meaning."""
        return Fixed(self.threshold_format, np.zeros_like(exponent))

    def lit(self, spans, halfway, threshold):
        """All."""
        return np.ones((len(spans), len(halfway)), dtype=bool)


@dataclass(frozen=True)
class Toy(Interpolator):
    """Straight lines between vectors at a twentieth of their length, divided by their lengths in float64."""

    SHARE: ClassVar[float] = 0.05
    operand: ClassVar = "cosine"
    name: ClassVar = "toy"
    serves_gate: ClassVar = True

    def gate(self, specular):
        return NoGate()

    def cut(self, cutter):
        return cutter.by_length(64.0)

    def filled(self, filler):
        spans = filler.with_lines()
        ends = {f"normal_{side}": getattr(spans, f"normal_{side}") * self.SHARE for side in ("left", "right")}
        return replace(spans, **ends)

    def exact_frame(self, shading):
        return shading.by_lines()

    def bound(self, bounds):
        return 7.0

    def operands(self, spans, constants, highlights):
        assert highlights
        span, step = pixels_of(spans.length)
        t = (step / np.maximum(spans.length - 1, 1)[span])[:, np.newaxis]
        normal = normalise((1 - t) * spans.normal_left[span] + t * spans.normal_right[span])
        vectors = (np.asarray(codes) * 2.0**-17 for codes in (constants.direction, constants.halfway))
        products = (Fixed.round(self.COSINE_FORMAT, normal @ vector.T) for vector in vectors)
        return Operands(*products, np.zeros(len(spans), dtype=bool))


@pytest.mark.parametrize("gate", [False, True])
def test_a_toy_method_renders_a_frame(gate):
    """Nothing asks for its type: the frame is exact but for rounding, by the steps that the toy chose."""
    scene = facing([[-0.7, 0.1, 1], [0.8, 0.2, 1], [0.1, 0.9, 0.7]], exponent=20)
    design = ShadingPipeline(Toy(), Specular(COSQUAD), gate=gate).for_materials(scene.materials)
    frame = model_frame(scene, design)
    found = compare(scene, design, frame)
    assert found.visible_pixels > 1000
    assert found.method_error.steady_lsb < 0.6
    assert found.arithmetic_error.steady_lsb < 0.6
    assert frame.prepared.spans_cut == 0
    assert error_bound(scene, design, frame.cut_raster) == found.bound_lsb == 7.0
    assert len(np.unique(frame.image.reshape(-1, 3), axis=0)) > 100
