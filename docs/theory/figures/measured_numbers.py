"""Numbers of measured.md."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from markdown import table

from blysk.bench.accuracy import scene_for
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.measured import MEASURED, AbcFit
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot


def _materials() -> str:
    rows = []
    for name, fit in MEASURED.items():
        diffuse, specular = (" ".join(f"{value:.3f}" for value in of) for of in fit.coefficients)
        rows.append([f"`{name}`", f"{fit.b:.6g}", f"{fit.c:.6g}", f"{fit.index:.6g}", diffuse, specular])
    return table(["material", "B", "C", "index", "k_d", "k_s"], rows, 1)


def _scene(fit: AbcFit) -> Scene:
    """The teapot of 992 triangles, made of a material."""
    diffuse, specular = (tuple(of.tolist()) for of in fit.coefficients)
    return replace(scene_for(teapot(1_000), 1, 320, 240), material=Material((0.0,) * 3, diffuse, specular, 1))


def _tables() -> str:
    rows = []
    for name, fit in MEASURED.items():
        row, scene = [f"`{name}`"], _scene(fit)
        for method in ("quotient", "chord-local"):
            design = preset(method, fit.lobe(name)).for_materials(scene.materials)
            row.append(f"{255 * design.specular.line_error(None):.3f}")
            found = compare(scene, design, model_frame(scene, design))
            row.append(f"{found.method_error.steady_lsb:.2f}")
            if method == "quotient":
                row.append(f"{found.bound_lsb:.2f}")
        rows.append(row)
    heads = ["`quotient`: table", "frame", "bound", "`chord-local`: table", "frame"]
    return table(["material", *heads], rows, 1)


def _left_out() -> str:
    rows = []
    for name, fit in MEASURED.items():
        scene = _scene(fit)
        raster = rasterise(scene)
        which = np.flatnonzero(raster.visible)
        normal = fragment_normals(scene, raster, which)
        light, viewer = np.array(scene.lights[0].towards(None)), scene.view_vectors(None)
        light, viewer = (np.broadcast_to(of, normal.shape) for of in (light, viewer))
        whole = fit.light(normal, light, viewer)
        halfway = normalise(light[:1] + viewer[:1])
        lit = np.einsum("ij,ij->i", normal, light)[:, np.newaxis]
        term = fit.lobe(name).reflect(normal @ halfway[0])[:, np.newaxis] * (lit > 0)
        row = [f"`{name}`"]
        turned = float(fit.fresnel(np.array(light[0] @ halfway[0]))) / fit.facing
        for factor in (1.0, turned):
            diffuse, specular = fit.coefficients
            reduced = diffuse * np.maximum(lit, 0) + factor * specular * term
            off = 255 * np.abs(np.clip(reduced, 0, 1) - np.clip(whole, 0, 1)).max(axis=1)
            row += [f"{value:.1f}" for value in (off.mean(), np.quantile(off, 0.99), off.max())]
        rows.append(row)
    heads = ["mean", "99 %", "largest"]
    return table(["material", *heads, *(f"{head}, F of the light" for head in heads)], rows, 1)


def _sentences() -> list[str]:
    return []


TABLES: dict[str, Callable[[], str]] = {
    "measured-materials": _materials,
    "measured-tables": _tables,
    "measured-left-out": _left_out,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {"measured.md": _sentences}
