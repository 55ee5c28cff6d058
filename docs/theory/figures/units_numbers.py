"""Numbers of units.md."""

import math
from collections.abc import Callable
from itertools import chain
from typing import cast

import numpy as np
from markdown import table

from blysk.bench.accuracy import scene_for
from blysk.bench.lobe_errors import CASES, errors_of_size
from blysk.bench.report.errata import second_lobe
from blysk.bench.surfaces import sphere
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.compare import compare_image
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import prepare
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.intensity import MAX_INTENSITY, Intensity
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.reflection import COSQUAD
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot


def _slopes() -> str:
    unit = Specular(COSQUAD)
    rows = []
    for n in (1, 2, 10, 100, 500, 1000):
        scale, shift = unit.scale(np.array([n]))
        k = float(unit.slopes.values[n])
        zero = math.degrees(math.acos(max(1 - 1 / k, -1)))
        rows.append([str(n), f"{k:g}", f"{float(scale.values[0]):.6g}", str(int(shift[0])), f"{zero:.1f}°"])
    return table(["n", "k = n/2", "K", "s", "base is 0 at gamma ="], rows, 0)


def _arguments(count: int = 20_001) -> Fixed:
    """Arguments 1 - cos gamma: evenly spaced, and as many near 0."""
    even = np.linspace(0, 2 - 2.0**-25, count)
    return Fixed.round(
        Specular.ARGUMENT_FORMAT, np.unique(np.r_[even, np.geomspace(2.0**-25, 2, count)[:-1]])
    )


def _errors() -> str:
    arguments = _arguments()
    nothing = np.zeros(arguments.codes.shape, dtype=bool)
    rows = []
    for name in ("cosquad", "lyon2", "lyon3", "exp", "coscos2", "coscos4", "blinn_product"):
        model = MODELS[name]
        unit = (
            Power("one_minus_cosine")
            if name == "blinn_product"
            else Specular(model.reflection, "one_minus_cosine")
        )
        bound = unit.ERROR if name == "blinn_product" else unit.error
        worst = 0.0
        for n in (1, 2, 3, 10, 100, 513, 1000):
            found = unit.compute(arguments, nothing, n).values
            exact = unit.reflection.reflect(1 - arguments.values, n)
            # Under the cutoff the unit gives 0 on purpose.
            counted = (found > 0) | (exact > 2.0**-13)
            worst = max(worst, float(np.abs(found - exact)[counted].max()))
        rows.append([f"`{name}`", f"{worst:.1e}", f"{bound:.1e}", f"{255 * bound:.3f}"])
    return table(["model", "largest error found", "bound", "bound, LSB at intensity 1"], rows)


def _thresholds() -> str:
    exponents = (1, 2, 3, 10, 100, 1000)
    rows = []
    for name in ("cosquad", "lyon3_refitted", "exp", "blinn_product"):
        gate = HighlightGate(METHODS["quadratic"].gate_limits, MODELS[name])
        level = np.sqrt(gate.thresholds.values[list(exponents)])
        angle = np.degrees(np.arccos(np.minimum(level, 1)))
        rows.append(
            [
                f"`{name}`",
                *("every span" if t == 0 else f"{a:.1f}°" for t, a in zip(level, angle, strict=True)),
            ]
        )
    return table(["model", *(f"n = {n}" for n in exponents)], rows)


def _lit() -> str:
    rows = []
    for exponent in (2, 10, 50, 200, 1000):
        scene = scene_for(teapot(10_000), exponent, 320, 240)
        row = [str(exponent)]
        for name in ("cosquad", "blinn_product"):
            design = preset("quadratic", name, gate=True)
            spans = prepare(scene, design).spans
            lit = design.lit_spans(spans, FrameConstants.of(scene))
            row.append(f"{lit.mean():.1%}")
        rows.append(row)
    return table(["n", "spans let through, `cosquad`", "`blinn_product`"], rows, 0)


def arc_maximum_error(count: int = 2000) -> float:
    """Largest difference of the gate's closed form and a search along arcs."""
    rng = np.random.default_rng(1)
    left, across, halfway = rng.normal(size=(3, count, 3))
    left, halfway = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (left, halfway))
    across -= (across * left).sum(axis=1, keepdims=True) * left
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    psi = rng.uniform(0.01, np.pi / 2, (count, 1))
    right = np.cos(psi) * left + np.sin(psi) * across
    a, b, u = (left * halfway).sum(1), (right * halfway).sum(1), 1 - np.cos(psi[:, 0])
    keep = (a > 0) & (b > 0)
    inside = np.maximum(a, b) * u > np.abs(a - b)
    with np.errstate(invalid="ignore"):
        peak = np.sqrt(((a - b) ** 2 + 2 * a * b * u) / (u * (2 - u)))
    formula = np.where(inside, peak, np.maximum(a, b))
    angle = psi * np.linspace(0, 1, 2001)
    dots = np.cos(angle) * a[:, np.newaxis] + np.sin(angle) * (across * halfway).sum(1)[:, np.newaxis]
    return float(np.abs(formula - dots.max(axis=1))[keep].max())


def lobe_error(function: Callable[[np.ndarray], np.ndarray], octaves: int, steps: int) -> float:
    """Largest error, in LSB, of a table of octaves with linear interpolation, entries of 16 fraction bits."""
    starts = [np.linspace(2.0 ** -(e + 1), 2.0**-e, steps, endpoint=False) for e in reversed(range(octaves))]
    places = np.concatenate([np.linspace(0, 2.0**-octaves, steps, endpoint=False), *starts, [1.0]])
    entries = np.floor(function(places) * 65536 + 0.5) / 65536
    u = np.unique(np.r_[np.geomspace(1e-9, 1, 100_001), np.linspace(0, 1, 100_001)])
    return float(255 * np.abs(np.interp(u, places, entries) - function(u)).max())


def _power(exponent: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda u: (1 - u) ** exponent


def _beckmann(m: float) -> Callable[[np.ndarray], np.ndarray]:
    def function(u):
        cosine = np.maximum(1 - u, 1e-9)
        # Beyond the largest exponent of a float64 the lobe is 0.
        return np.exp(np.maximum(-(1 / cosine**2 - 1) / m**2, -700)) / cosine**4 * (u < 1)

    return function


def _ggx(a: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda u: (1 + u * (2 - u) * (1 - a * a) / (a * a)) ** -2


_LOBES = {
    "Blinn n = 1": _power(1),
    "10": _power(10),
    "100": _power(100),
    "1000": _power(1000),
    "Beckmann m = 0.03": _beckmann(0.03),
    "0.1": _beckmann(0.1),
    "0.3": _beckmann(0.3),
    "0.6": _beckmann(0.6),
    "GGX a = 0.01": _ggx(0.01),
    " 0.03": _ggx(0.03),
    " 0.1": _ggx(0.1),
    " 0.3": _ggx(0.3),
}


def _lobes() -> str:
    rows = []
    for octaves, steps in ((8, 16), (12, 16), (12, 32), (14, 32)):
        errors = (f"{lobe_error(function, octaves, steps):.2g}" for function in _LOBES.values())
        rows.append([f"{octaves}, {steps}", str((octaves + 1) * steps + 1), *errors])
    return table(["E, M", "entries", *_LOBES], rows)


def _lobe_unit() -> str:
    rows = []
    for octaves, steps in ((12, 16), (15, 32), (20, 16)):
        errors = chain(*errors_of_size(octaves, steps, 64))
        rows.append(
            [f"{octaves}, {steps}", str((octaves + 1) * steps), *(f"{error:.2f}" for error in errors)]
        )
    names = {"blinn": "Blinn", "beckmann": "Beckmann", "ggx": "GGX"}
    heads = [
        f"{names[case.reflection.name]} {'n' if case.label == 'n' else 'a'} = {value:g}"
        if k == 0
        else f"{value:g}"
        for case in CASES
        for k, value in enumerate(case.values)
    ]
    return table(["E, M", "words", *heads], rows)


_SHARP = (0.05, 0.07, 0.1)
"""Roughnesses of lobes that are sharp."""

_LIGHTS = 10
"""Frames of a cell in the table of sharp lobes, one light each."""


def _sharp_lobes() -> str:
    """Largest method error, and pieces a span, without and with the scale of a sharp lobe."""
    rows = []
    triangle = Mesh(
        np.array([(-1, -0.8, 0), (1.1, -0.6, 0.1), (-0.1, 1, 0)]),
        np.array([(0, 1, 2)]),
        normalise(np.array([(-0.35, -0.3, 1), (0.4, -0.2, 1), (0, 0.45, 1)])),
    )
    meshes = {"sphere": sphere(16), "teapot": teapot(1000), "one triangle": triangle}
    towards = np.random.default_rng(2026).normal((0, 0, 1), 1, (_LIGHTS, 3))
    for name, mesh in meshes.items():
        count = len(mesh.faces)
        camera = Camera.framing(mesh.vertices, (0.2, 0.3, 1), "orthographic", 4 / 3)
        for roughness in _SHARP:
            material = Material((0.05,) * 3, (0.4, 0.3, 0.2), (0.55, 0.5, 0.6), 50, roughness)
            plain = preset("chord-local", "ggx")
            scaled = plain.for_materials([material])
            cells = []
            for design in (plain, scaled):
                errors, pieces = [], []
                for light in towards:
                    scene = Scene(mesh, camera, 160, 120, material, (Light(tuple(light)),))
                    frame = model_frame(scene, design)
                    errors.append(compare_image(scene, design, frame.image).method_error.max_lsb)
                    pieces.append(frame.spans / len(frame.raster.length))
                cells.append(f"{max(errors):.2f}, {np.mean(pieces):.2f}")
            scale = cast(Lobe, scaled.specular).scale
            title = name if count == 1 else f"{name}, {count:,}"
            rows.append([title, f"{roughness:g}", *cells, str(scale)])
    return table(["mesh, triangles", "r", "error, pieces with s = 0", "with s", "s"], rows)


def _sentences() -> list[str]:
    squared = 20 / 2 * (math.cos(math.radians(60)) - 1) + 1
    assert squared**2 == second_lobe()[0]
    widest = math.degrees(math.acos(1 - 2 / 10))
    largest = Intensity.COLOR_FORMAT.max_code * Intensity.COLOR_FORMAT.step
    difference = arc_maximum_error()
    assert difference < 1e-6
    margin = HighlightGate(METHODS["quadratic"].gate_limits).margin * 2**17
    entries = _largest_amplification()
    return [
        f"n = 20 and gamma = 60° the square is {squared**2:.0f}",
        f"from {widest:.1f}° on",
        f"`CUTOFF^2 = 2^-14`, {255 * 2.0**-14:.3f} LSB at intensity 1 and "
        f"{MAX_INTENSITY * 255 * 2.0**-14:.3f} LSB at the largest, {MAX_INTENSITY}",
        f"up to {largest:.2f} LSB",
        f"{margin:.0f} steps of 2^-17 for `quadratic`",
        f"`{entries[1]:.2f} * 2^-17`, at n = {entries[0]}",
        f"at most `6 * 2^-17`, {255 * 6 * 2.0**-17:.3f} LSB at intensity 1",
    ]


def _largest_amplification() -> tuple[int, float]:
    """Exponent of the largest bound of the power's error, and the bound in steps of 2^-17.

    A product of cut factors p, q is off by ``p + q`` steps at most, and what follows multiplies an error of a
    factor by one less the other. With c = 1 - x all is a function of c, here searched.
    """
    best = (0, 0.0)
    c = 1 - np.geomspace(1e-5, 1, 4001)
    for n in range(1, 1001):
        s, x = np.zeros_like(c), 1 - c
        s_error, x_error = np.zeros_like(c), np.zeros_like(c)
        bits = n.bit_length()
        for bit in range(bits):
            if n >> bit & 1:
                # The first product, with s = 0, is exact.
                cut = np.where(s > 0, s + x, 0.0)
                s_error = s_error * (1 - x) + x_error * (1 - s) + cut
                s = s + x - s * x
            x_error = 2 * x_error * (1 - x) + 2 * x
            x = 2 * x - x * x
        worst = float(s_error.max()) + 1
        best = max(best, (n, worst), key=lambda pair: pair[1])
    return best


TABLES: dict[str, Callable[[], str]] = {
    "slopes": _slopes,
    "specular-errors": _errors,
    "gate-angles": _thresholds,
    "gate-shares": _lit,
    "lobes": _lobes,
    "lobe-unit": _lobe_unit,
    "sharp-lobes": _sharp_lobes,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {"units.md": _sentences}
