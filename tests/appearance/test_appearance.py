"""Pictures of files whose look is known, compared with those of VTK: another reader and another renderer."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pytest

import blysk
from blysk.golden.frames.frame import background_code, model_frame
from blysk.golden.frames.surface import design_for
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.golden.reference.transfer import encode

from .formats import COLORED
from .pictures import drawn
from .samples import SAMPLES as OF_GLTF

SAMPLES = OF_GLTF | COLORED
SIZE = 128, 96
LOOK = {"projection": "orthographic", "view": (0.1, 0.2, 1), "background": (0.2, 0, 0.2)}
SHIFTS = (0, 0), (0.0625, 0), (-0.0625, 0), (0, 0.0625), (0, -0.0625)
OPTIONS = "view", "back_faces", "lights", "ambient", "diffuse", "specular", "projection", "field_of_view"
QUICK = (
    "texture settings, 3",
    "vertex colours, u2 x 4",
    "holes, bilinear",
    "OBJ, image",
    "PLY, colours, ascii",
)


class Pictures(NamedTuple):
    """A sample drawn by both renderers, in codes of sRGB."""

    scene: Any
    mask: np.ndarray
    ours: np.ndarray
    theirs: np.ndarray
    sure: np.ndarray
    """Pixels that do not change when VTK's camera moves by 1/16 pixel: no edges and no borders of texels."""


@cache
def pictures(name: str) -> Pictures:
    make, given = SAMPLES[name]
    file, look = make(**given) if isinstance(given, dict) else make(*given)
    options = {key: look.pop(key) for key in OPTIONS if key in look}
    lit, cutoff = bool(options.get("lights")), look.pop("cutoff", 0.0)
    with TemporaryDirectory() as folder:
        # A warning about contents that are not read would be an error.
        scene = blysk.scene(file.write(Path(folder)), size=SIZE, **LOOK | options)
        seen = drawn(file.for_vtk(Path(folder)), scene, look, SHIFTS, lit, cutoff).astype(int)
    frame = render(scene, model=REFLECTION_MODELS["phong"])
    sure = (np.abs(seen - seen[0]) <= 8).all(axis=(0, -1))
    return Pictures(scene, frame.mask, 255 * encode(frame.image), seen[0], sure)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.long) for name in SAMPLES]
)
def test_vtk_draws_the_same_picture(name):
    pytest.importorskip("vtkmodules", reason="VTK is not installed")
    scene, mask, ours, theirs, sure = pictures(name)
    covered = (theirs != background_code(scene, "srgb")).any(axis=-1)
    assert covered.mean() > 0.15
    assert sure[covered].mean() > 0.9
    assert (covered == mask)[sure].all()
    assert np.abs(ours - theirs)[sure].max() <= 2


@pytest.mark.long
def test_codes_of_greys_come_out_as_they_are():
    pytest.importorskip("vtkmodules", reason="VTK is not installed")
    _, mask, ours, theirs, _ = pictures("grey ramp")
    for picture in ours, theirs:
        assert np.unique(np.rint(picture[mask])).tolist() == list(range(256))
    assert np.array_equal(np.rint(ours), theirs)


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        *("vertex colours, f4 x 3", "texture settings, 4", "texture transform", "factor times texture"),
        *("metal", "parts", "holes, bilinear", "holes in perspective", "OBJ, image"),
    ],
)
def test_the_pipeline_draws_the_same_picture(name):
    """The bit-accurate model is within 1 LSB of the exact frame, and so it is near VTK's picture."""
    pytest.importorskip("vtkmodules", reason="VTK is not installed")
    scene, mask, ours, theirs, sure = pictures(name)
    image = model_frame(scene, design_for(blysk.design(model="phong"), scene)).image
    assert np.abs(image - ours)[mask & sure].max() <= 1
    assert np.abs(image - theirs)[sure].max() <= 3
