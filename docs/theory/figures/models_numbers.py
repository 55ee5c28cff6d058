"""Numbers of models.md."""

import math
from collections.abc import Callable

import numpy as np
from markdown import table

from blysk.bench.accuracy import scene_for
from blysk.bench.report import perception
from blysk.golden.reference.lighting import Light, Material, gram_determinant, intensity
from blysk.golden.reference.metrics import error_figures, mnse_published, nmse
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import (
    BLINN,
    COSQUAD,
    PHONG,
    REFLECTION_MODELS,
    AngleCosine,
    PolynomialModel,
    ReflectionModel,
    coscos_scale,
    exponent_ratio,
)
from blysk.golden.reference.renderer import render, shade_spans
from blysk.sim.meshes.teapot import teapot

_X = np.linspace(0, 30, 6001)
_SHOWN = (16, 64, 256)


def largest_error(model: ReflectionModel, exponent: int) -> float:
    """Largest error of a model against Blinn's, over all angles to which n (1 - c) is at most 30."""
    cosine = 1 - _X[exponent >= _X] / exponent
    return float(np.abs(model.reflect(cosine, exponent) - BLINN.reflect(cosine, exponent)).max())


def formula(model: ReflectionModel) -> str:
    """Formula of a model, with its coefficients."""
    if isinstance(model, AngleCosine):
        rule = f"sqrt(n/{model.power})" if model.rule == "taylor" else "by equal integrals"
        return f"`cos^{model.power}(a gamma)`, a {rule}"
    if isinstance(model, PolynomialModel):
        power = 2**model.squarings
        if model.curve is not None:
            return f"`max(1 - k (1-c), 0)^{power}`, k below"
        slope = {0.5: "n/2", 0.4375: "7n/16", 0.25: "n/4", 0.125: "n/8"}.get(model.a)
        return f"`max(1 - ({slope or f'{model.a} n + {model.b}'}) (1-c), 0)^{power}`"
    return "`exp(-n (1-c))`" if model.name == "exp" else "`max(c, 0)^n`"


def _models() -> str:
    rows = []
    for model in REFLECTION_MODELS.values():
        is_power = model in (PHONG, BLINN)
        errors = ["" if is_power else f"{largest_error(model, n):.3f}" for n in _SHOWN]
        rows.append(
            [f"`{model.name}`", formula(model), model.source.replace("Lyon 1993", "[Lyon93]"), *errors]
        )
    return table(["name", "S", "source", *(f"n = {n}" for n in _SHOWN)], rows, 3)


def _energy() -> str:
    shown = (1, 2, 10, 50, 100, 1000)
    rows = [
        [f"`{name}`", *(f"{model.energy_factor(n):.4g}" for n in shown), str(_largest_exponent(model))]
        for name, model in REFLECTION_MODELS.items()
        if model.energy
    ]
    return table(["model", *(f"n = {n}" for n in shown), "largest n with factor <= 8"], rows)


def _largest_exponent(model: ReflectionModel) -> int:
    return max(n for n in range(1, 1001) if model.energy_factor(n) <= 8)


def _curves() -> str:
    rows = []
    for triangles in (200, 1_000, 10_000):
        mesh = teapot(triangles)
        found = []
        for exponent in (20, 100, 1000):
            scene = scene_for(mesh, exponent, 320, 240)
            raster = rasterise(scene)
            exact = render(scene, "phong", COSQUAD, raster)
            for curve in ("normalised", "slerp"):
                image = shade_spans(scene, raster, curve, COSQUAD)
                figures = error_figures(image * 255, exact.image * 255, exact.mask)
                found.append(f"{figures.max_lsb:.1f}")
            error = _true_span_error(scene, raster, exact.image)
            found.append("under 1e-9" if error < 1e-9 else f"{error:.1f}")
        order = [found[k] for curve in range(3) for k in range(curve, len(found), 3)]
        rows.append([f"{len(mesh.faces):,}", *order])
    kinds = ("unit ends", "great circle", "with lengths")
    return table(["triangles", *(f"{kind}, n = {n}" for kind in kinds for n in (20, 100, 1000))], rows)


def _true_span_error(scene, raster, exact) -> float:
    """Largest error, in LSB, of the line between normals that have their lengths."""
    which = np.flatnonzero(raster.visible)
    span = raster.span[which]
    t = (raster.offset[which] / np.maximum(raster.length[span] - 1, 1))[:, np.newaxis]
    left = raster.magnitude_left[span][:, np.newaxis] * raster.normal_left[span]
    right = raster.magnitude_right[span][:, np.newaxis] * raster.normal_right[span]
    line = (1 - t) * left + t * right
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    lighting = scene.lights, scene.ambient_light, scene.view_vectors(None)
    found = intensity(line, scene.materials[0], *lighting, COSQUAD)
    shown = exact.reshape(-1, 3)[raster.pixel[which]]
    return float(255 * np.abs(np.clip(found, 0, 1) - shown).max())


def _example() -> str:
    normal, light, viewer = np.array([0.0, 0, 1]), Light((1, 1, 1)), np.array([0.0, 0, 1])
    cosine = float(normal @ light.towards(None))
    mirrored = 2 * cosine * float(normal @ viewer) - float(light.towards(None) @ viewer)
    terms = 0.1 * 0.2, 0.7 * 0.8 * cosine, 0.5 * float(PHONG.reflect(mirrored, 10))
    rows = [
        ["ambient `k_a I_a`", "0.1 * 0.2", f"{terms[0]:.6f}"],
        ["diffuse `k_d I_d (N·L)`", f"0.7 * 0.8 * {cosine:.6f}", f"{terms[1]:.6f}"],
        ["specular `k_s I_s (R·V)^10`", f"0.5 * {mirrored:.6f}^10", f"{terms[2]:.6f}"],
        ["sum", "", f"**{sum(terms):.6f}**"],
    ]
    assert math.isclose(sum(terms), _example_by_code(), abs_tol=1e-15)
    return table(["term", "numbers", "value"], rows, 2)


def _example_by_code() -> float:
    """The same by `intensity`, with one light for the diffuse and one for the specular term."""
    axis = np.array([0.0, 0, 1])
    dull = Material((0.1,) * 3, (0.7,) * 3, (0,) * 3, 10)
    glossy = Material((0,) * 3, (0,) * 3, (0.5,) * 3, 10)
    total = intensity(axis, dull, [Light((1, 1, 1), (0.8,) * 3)], (0.2,) * 3, axis, PHONG)
    return float((total + intensity(axis, glossy, [Light((1, 1, 1))], (0, 0, 0), axis, PHONG))[0])


def _published_slope() -> tuple[float, float, float]:
    every = np.arange(2, 1001)
    exact, line, refitted = (
        np.array([REFLECTION_MODELS[name].slope(n) for n in every])
        for name in ("cosquad_q", "cosquad_lin", "cosquad_lin_refitted")
    )
    limit = (1 - 0.8) / -math.log(0.64)
    return float(np.abs(line / exact - 1).max()), float(np.abs(refitted / exact - 1).max()), limit


def _steepest(model: ReflectionModel, exponent: int = 1000) -> float:
    """Largest change of a model a radian, over sqrt(n)."""
    gamma = np.linspace(0, 6 / math.sqrt(exponent), 200_001)
    values = model.reflect(np.cos(gamma), exponent)
    return float(np.abs(np.gradient(values, gamma)).max() / math.sqrt(exponent))


def _reflected() -> list[float]:
    """Energy that `cosquad_lin` reflects with its factor, by exponent from 1 to 1000."""
    model = REFLECTION_MODELS["cosquad_lin"]
    found = []
    for n in range(1, 1001):
        # With x = 1 - c, from 0 to where the base is 0: the integral of (1 - k x)^2 (1 - x), times 2 pi.
        k = model.slope(n)
        x = np.polynomial.Polynomial([0, 1])
        whole = ((1 - k * x) ** 2 * (1 - x)).integ()
        found.append(2 * math.pi * model.energy_factor(n) * float(whole(min(1 / k, 1.0))))
    return found


def _metrics() -> tuple[float, float, float, float]:
    """NMSE and MNSE as published of one LSB in the pixel nearest to the mean, and in the farthest."""
    reference = np.linspace(0, 255, 256) ** 2 / 255
    distance = np.abs(reference - reference.mean())
    found = []
    for place in (distance.argmin(), distance.argmax()):
        image = reference.copy()
        image[place] += 1
        found += [nmse(image, reference), mnse_published(image, reference)[0]]
    return found[0], found[2], found[1], found[3]


def _sentences() -> list[str]:
    line, refitted, limit = _published_slope()
    scales = ", ".join(f"{coscos_scale(n, 2, 'integral'):.5f}" for n in (5, 20, 100))
    ratios = [float(exponent_ratio(math.cos(math.radians(gamma)))) for gamma in (0, 10, 30, 40)]
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(3, 1000, 3))
    normal, light, viewer = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    triple = np.einsum("ij,ij->i", np.cross(light, normal), viewer) ** 2
    gram = np.abs(gram_determinant(normal, light, viewer) - triple).max()
    same, other, near, far = _metrics()
    steepest, slow = _steepest(COSQUAD), _steepest(REFLECTION_MODELS["exp"])
    assert math.isclose(same, other, rel_tol=1e-9)
    reflected = _reflected()
    over = sum(energy > 1 for energy in reflected[1:]) / 999
    most = int(np.argmax(reflected))
    slopes = (largest_error(REFLECTION_MODELS[name], 256) for name in ("lyon1_refitted", "cosquad_lin"))
    return [
        f"within {line:.2%} of this k for n from 2 to 1000 (`{0.44813} n + {0.10235}`: {refitted:.2%})",
        f"`k/n` tends to `(1 - 0.8) / -ln 0.64 = {limit:.4f}`",
        f"a = {scales} for n = 5, 20, 100",
        "{:.0f} at gamma = 0, {:.2f} at 10°, {:.2f} at 30°, {:.2f} at 40°".format(*ratios),
        f"differ by less than {'1e-14' if gram < 1e-14 else gram} for 1,000 random triples",
        f"`{steepest:.3f} sqrt(n)` for `cosquad`, `{slow:.3f} sqrt(n)` for `exp`",
        f"At exponent 100 that is {2550 * steepest * math.radians(0.1):.1f} LSB for a normal that is turned",
        f"The figure is {near:.2g} if this pixel is nearest to the mean, and {far:.2g} if it is farthest",
        f"FLIP p99 <= {perception.FLIP_P99} and max <= {perception.FLIP_MAX:.2f}, and CIEDE2000 p99 <= "
        f"{perception.CIEDE2000_P99} and max <= {perception.CIEDE2000_MAX}",
        f"the largest error is at most {perception.LARGEST_LSB:.0f} LSB",
        f"reflects {reflected[1]:.4f} at n = 2 and {reflected[most]:.4f} at most, at n = {most + 1}",
        f"{over:.1%} of the exponents".replace("%", " %"),
        f"outside the range of [C], it is {reflected[0]:.4f}",
        "has {:.3f} in place of {:.3f} at n = 256".format(*slopes),
    ]


TABLES: dict[str, Callable[[], str]] = {
    "reflection-models": _models,
    "energy": _energy,
    "curves": _curves,
    "worked-example": _example,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {"models.md": _sentences}
