"""Fitted pipelines: a test for each rule, and the frame of the full pipeline to the bit."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import constants_of, prepare
from blysk.golden.frames.surface import design_for
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.frames.specialise import specialise
from blysk.sim.meshes.teapot import teapot

KEY, FILL, BLACK = Light((-0.5, 0.8, 0.7)), Light((0.7, 0.1, 0.5)), Light((0, 0, 1), (0, 0, 0))
CLAY = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50)

FLOOR = Mesh(
    np.array([[0.0, 0, 0], [4, 0, 0], [4, 0, -4], [0, 0, -4]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
    np.tile([0.0, 1, 0], (4, 1)),
)


def scene_of(material=CLAY, lights=(KEY,), size=(600, 500), mesh=None, **options):
    mesh = mesh or teapot(2000)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", size[0] / size[1])
    return Scene(mesh, camera, *size, material, lights, **options)


def full_of(scene, **options):
    options = {"gate": True, **options}
    counts = {"lights": max(len(scene.lights), 1), "materials": len(scene.materials)}
    return preset(**{"method": "quadratic", "model": "cosquad"} | counts | options)


def pixels_of(scene, design):
    return design.compute(prepare(scene, design).spans, constants_of(scene, design))


def fitted(scene, full):
    """A pipeline fitted to a scene. The bit-accurate models draw the same frame.

    Spans of merged materials may come in another order.
    """
    special, frames = specialise(scene, full), []
    for drawn, design in ((scene, special.full), (special.scenes[0], special.design)):
        pixels = pixels_of(drawn, design)
        order = np.lexsort((*pixels.color.T, pixels.x, pixels.y))
        frames.append((pixels.x[order], pixels.y[order], pixels.color[order]))
    for whole, smaller in zip(*frames, strict=True):
        np.testing.assert_array_equal(whole, smaller)
    return special


def reasons(special):
    return {
        name: reduction.reason
        for reduction in special.reductions
        for key, value in reduction.changes.items()
        for name in (value if isinstance(value, dict) else [key])
    }


def test_vectors_keep_lights_and_highlights():
    """Vectors depend on lights and on highlights. Without one of them a pixel of this frame changes."""
    matt = replace(CLAY, specular=(0, 0, 0))
    scene = scene_of(matt, size=(160, 120), mesh=teapot(992))
    full = full_of(scene, method="quotient", model="blinn", gate=False)
    assert not {"specular", "lights"} & set(reasons(fitted(scene, full)))
    assert "specular" in reasons(specialise(scene, full, exact=False))
    scene = scene_of(lights=(Light((0, 0, -1), (0, 0, 0)), KEY), size=(160, 120), mesh=teapot(992))
    full = full_of(scene, method="quotient", model="phong", gate=False)
    assert not {"specular", "lights"} & set(reasons(fitted(scene, full)))
    assert "lights" in reasons(specialise(scene, full, exact=False))


def test_everything_is_needed():
    """Two different materials, coloured light and highlights: only the widths become smaller."""
    mesh = teapot(2000)
    mesh = replace(mesh, material=np.arange(len(mesh.faces)) % 2)
    scene = scene_of((CLAY, replace(CLAY, exponent=9)), (KEY, FILL), mesh=mesh)
    special = fitted(scene, full_of(scene))
    assert set(reasons(special)) == {"x_bits", "y_bits", "length_bits"}


@pytest.mark.long
@pytest.mark.parametrize("style", ["throughput", "compact"])
def test_no_specular_path(style):
    scene = scene_of(replace(CLAY, specular=(0, 0, 0)))
    special = fitted(scene, full_of(scene, style=style))
    assert reasons(special)["specular"] == "no specular path: every k_s is 0"
    assert (special.design.model, special.design.gate, special.design.build.exponent) == (None, False, None)
    full, steps = special.costs()
    assert steps[0].multiplier_count <= full.multiplier_count - (6 if style == "throughput" else 1)
    assert steps[-1].register_bits < steps[0].register_bits < 0.76 * full.register_bits
    assert all(
        after.rom_bits <= before.rom_bits for before, after in zip((full, *steps), steps, strict=False)
    )


def test_no_highlight_by_the_gate():
    """The light is behind, so its half-way vector is far from every normal."""
    scene = scene_of(replace(CLAY, exponent=500), (Light((0.3, 0.3, -1)),), mesh=FLOOR)
    special = fitted(scene, full_of(scene))
    assert reasons(special)["specular"] == "no specular path: the gate proves that no span holds a highlight"


def test_no_gate():
    """At exponent 1 the highlight is everywhere."""
    scene = scene_of(replace(CLAY, exponent=1))
    special = fitted(scene, full_of(scene))
    assert reasons(special)["gate"] == "no highlight gate: every span may hold a highlight"
    assert not special.design.gate
    assert "gate" not in reasons(specialise(scene, full_of(scene, gate=False)))


@pytest.mark.long
def test_fixed_exponent():
    scene = scene_of()
    special = fitted(scene, full_of(scene))
    assert reasons(special)["exponent"] == "exponent fixed at 50: PROM folded"
    full, step = (cost_of(ShadingPipelineUnit(special.full.built(exponent=x))) for x in (None, 50))
    assert step.rom_bits <= full.rom_bits - 2 * 1024 * 17
    assert step.multiplier_count == full.multiplier_count - 1


@pytest.mark.long
def test_equal_materials():
    mesh = teapot(2000)
    mesh = replace(mesh, material=np.arange(len(mesh.faces)) % 3)
    other = replace(CLAY, diffuse=(0.1, 0.2, 0.3))
    scene = scene_of((CLAY, other, CLAY), mesh=mesh)
    special = fitted(scene, full_of(scene))
    assert reasons(special)["materials"] == "a smaller memory of materials: 2 of 3 are distinct"
    scene = scene_of((CLAY, CLAY, CLAY), mesh=mesh)
    special = fitted(scene, full_of(scene))
    assert reasons(special)["materials"] == "no memory of materials: 1 of 3 are distinct"
    assert (special.design.materials, special.design.build.exponent) == (1, 50)
    full = cost_of(ShadingPipelineUnit(special.full))
    assert cost_of(ShadingPipelineUnit(special.design)).ram_bits < full.ram_bits


def test_black_lights():
    """No span is cut for a light that is off. A light that is on counts, also if nothing shows it."""
    scene = scene_of(lights=(KEY, BLACK, FILL))
    special = fitted(scene, full_of(scene))
    assert reasons(special)["lights"] == "1 of 3 lights: they light nothing"
    assert special.scenes[0].lights == (KEY, FILL)
    faint = scene_of(lights=(KEY, Light((0, 0, 1), (1e-9,) * 3), FILL))
    assert "lights" not in reasons(specialise(faint, full_of(faint)))
    assert "lights" in reasons(specialise(faint, preset("linear", "cosquad", lights=3)))


def test_factors_of_lights():
    """The factor goes with its fading light, and all factors go with the specular path."""
    lamp = Light(position=(1, 2, 3), attenuation=(1, 1, 0))
    scene = scene_of(lights=(BLACK, KEY, lamp), size=(60, 50))
    full = preset("chord-local", "cosquad", 3, factors=(0, 2))
    special = fitted(scene, full)
    assert special.design.factors == (1,)
    matt = replace(scene, material=replace(CLAY, specular=(0, 0, 0)))
    assert specialise(matt, full).design.factors == ()


def test_a_light_that_is_off_costs_nothing():
    """A light that is off adds no span, and in the compact style no cycle, in a pipeline that has it.

    Its terms are 0.
    """
    design, found = preset("quadratic", "blinn", lights=2, style="compact"), []
    for lights in ((KEY,), (KEY, BLACK), (KEY, FILL)):
        scene = scene_of(lights=lights, size=(60, 50))
        spans, (constants,) = prepare(scene, design).spans, constants_of(scene, design)
        operands = design.operands(spans, constants)
        diffuse = Diffuse(operands.cosine.format)
        terms = (
            diffuse.compute(operands.cosine),
            design.specular.compute(operands.highlight, diffuse.dark(operands.cosine), constants.highlight),
        )
        found.append((len(spans), design.intensity.cycles(*terms).sum()))
    assert found[0] == found[1]
    assert found[2][1] > 1.3 * found[1][1]


def test_methods_that_no_gate_serves():
    """A light that is off does not cut spans that are cut by their error."""
    scene = scene_of(replace(CLAY, exponent=400), (KEY, BLACK, FILL))
    for method in ("chord-local", "quadratic-published", "renormalise"):
        special = fitted(scene, preset(method, "cosquad", lights=3))
        assert "lights" in reasons(special)
        assert reasons(special)["exponent"] == "exponent fixed at 400: PROM folded"
    dark = scene_of(lights=(BLACK,))
    special = fitted(dark, preset("chord-local", "cosquad"))
    assert reasons(special)["lights"] == "no light path: no light lights anything"


@pytest.mark.parametrize(
    ("material", "lights"),
    [(CLAY, ()), (CLAY, (BLACK,)), (replace(CLAY, diffuse=(0, 0, 0), specular=(0, 0, 0)), (KEY,))],
)
def test_no_light_at_all(material, lights):
    scene = scene_of(material, lights)
    special = fitted(scene, full_of(scene))
    assert reasons(special)["lights"] == "no light path: no light lights anything"
    assert cost_of(ShadingPipelineUnit(special.design)).multiplier_count == 0


def test_albedo():
    """Texture, tint and emission distinguish materials. Tints need specular light."""
    mesh = replace(FLOOR, coordinates=FLOOR.vertices[:, ::2], material=np.array([0, 1]))
    grey = Material(0.1, 0.5, 0.3, 30)
    images = [Texture(np.random.default_rng(seed).random((4, 4, 3))) for seed in (1, 2)]
    textured = [replace(grey, texture=image) for image in images]
    black = replace(textured[0], specular=0)
    for materials, count in (
        (textured, 2),
        ((textured[0], replace(textured[0], tinted=True)), 2),
        ((black, replace(black, tinted=True)), 2),
        ((black, replace(black, emission=(0.1, 0, 0))), 2),
        ((textured[0], replace(grey, texture=images[0])), 1),
    ):
        scene = scene_of(materials, size=(60, 50), mesh=mesh)
        special = fitted(scene, design_for(full_of(scene), scene))
        assert special.design.materials == count
        assert "grey" not in reasons(special)
    for material in (black, replace(grey, texture=images[0], unlit=True)):
        scene = scene_of(
            replace(material, tinted=True), size=(60, 50), mesh=replace(mesh, material=mesh.material * 0)
        )
        special = fitted(scene, design_for(full_of(scene), scene))
        assert special.design.specular is None
        assert not special.design.albedo.tints


def test_one_channel():
    scene = scene_of(Material((0.1,) * 3, (0.5,) * 3, (0.4,) * 3, 30))
    special = fitted(scene, full_of(scene))
    assert reasons(special)["grey"] == "one channel of three: every colour is grey"
    tinted = replace(scene, lights=(Light((0, 0, 1), (1, 1, 0.9)),))
    assert "grey" not in reasons(specialise(tinted, full_of(tinted)))


def test_widths():
    scene = scene_of(size=(512, 300))
    special = fitted(scene, full_of(scene))
    longest = prepare(scene, special.full).spans.length.max()
    bits = int(longest).bit_length()
    assert (special.design.x_bits, special.design.y_bits, special.design.length_bits) == (9, 9, bits)
    assert reasons(special)["length_bits"] == f"length in {bits} bits: the longest span has {longest} pixels"
    assert reasons(special)["x_bits"] == "x in 9 bits: 512 columns"


@pytest.mark.long
def test_shorter_words():
    """Narrow and short spans: pixels change by at most a step, and the pipeline costs less."""
    for mesh in (teapot(2000), FLOOR):
        scene = scene_of(size=(100, 80), mesh=mesh)
        full = full_of(scene, method="chord-local", gate=False)
        assert "fraction_bits" not in reasons(specialise(scene, full))
        special = specialise(scene, full, exact=False)
        assert reasons(special)["fraction_bits"].startswith(
            "differences of 36 in place of 46 fraction bits: "
        )
        spans, constants = prepare(scene, full).spans, FrameConstants.of(scene)
        pixels = [design.compute(spans, constants) for design in (full, special.design)]
        assert [of.out_of_range_spans for of in pixels] == [0, 0]
        assert np.abs(np.diff([of.color.astype(int) for of in pixels], axis=0)).max() <= 1
    shorter = replace(full, interpolator=special.design.interpolator)
    less, more = (cost_of(ShadingPipelineUnit(design)) for design in (shorter, full))
    assert less.multiplier_count == more.multiplier_count
    assert less.register_bits <= more.register_bits - 240


def test_frames_of_a_turntable():
    """A part that any frame needs stays."""
    near, far = scene_of(), scene_of()
    out_of_range = Camera.framing(near.mesh.vertices * 4, (0.4, 0.5, 1), "perspective", 1.2)
    far = replace(far, camera=out_of_range)
    full = full_of(near)
    bits = [specialise(scenes, full).design.length_bits for scenes in (near, far, (far, near))]
    assert bits[1] < bits[0] == bits[2]


def test_nothing_on_the_picture():
    """Without spans there is no highlight either, and every width is the least."""
    mesh = teapot(200)
    away = Camera.framing(np.add(mesh.vertices, (100.0, -100.0, 0.0)), (0.4, 0.5, 1), "perspective", 1.0)
    scene = replace(scene_of(mesh=mesh), camera=away)
    special = specialise(scene, full_of(scene))
    assert (special.design.model, special.design.length_bits) == (None, 2)


def test_default_is_that_of_the_presets():
    scene = scene_of(lights=())
    assert specialise(scene).full == preset()


@pytest.mark.long
def test_simulated_frame():
    """The RTL of the smaller pipeline draws the frame of the full pipeline."""
    scene = scene_of(Material((0.1,) * 3, (0.5,) * 3, (0.4,) * 3, 30), (KEY, BLACK), size=(120, 90))
    special = specialise(scene, full_of(scene))
    assert {"lights", "exponent", "grey", "x_bits", "y_bits", "length_bits"} <= set(reasons(special))
    full = FrameSimulator(special.full).render(scene)
    smaller = FrameSimulator(special.design).render(special.scenes[0])
    np.testing.assert_array_equal(full.image, smaller.image)
    assert len(np.unique(full.image)) > 50
    assert smaller.cycles <= full.cycles
