"""Numbers of chord.md, and its figure."""

import io
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from markdown import table
from matplotlib import rc_context
from matplotlib.figure import Figure

from blysk.bench.accuracy import scene_for
from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.frames.compare import compare
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.frame import model_frame
from blysk.golden.number.polynomials import half_angle_factor, minimax
from blysk.golden.number.unit_vector import quantise, values
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import COSQUAD, REFLECTION_MODELS, ReflectionModel
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

_SPANS = 4000
_PLACES = np.linspace(0, 1, 65)
_PLAIN_FIT = minimax(lambda r: half_angle_factor(1 - r), 0.0, 1.0, 3)

Operand = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""1 - N·H at places t, from both ends and H."""


def half_chord(normal: np.ndarray, halfway: np.ndarray) -> np.ndarray:
    """``|N - H|^2 / 2``."""
    return np.square(normal - halfway).sum(axis=-1) / 2


def one_minus_dot(normal: np.ndarray, halfway: np.ndarray) -> np.ndarray:
    """``1 - N·H``."""
    return 1 - (normal * halfway).sum(axis=-1)


def quadratic(left: np.ndarray, middle: np.ndarray, right: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The quadratic through three values, at t = 0, 1/2 and 1."""
    return ((2 * (left + right) - 4 * middle) * t + (4 * middle - right - 3 * left)) * t + left


def _three_points(operand: Callable[[np.ndarray, np.ndarray], np.ndarray], plain: bool = False) -> Operand:
    def found(left, right, halfway, t):
        middle = left + right
        if plain:
            r = (left * right).sum(axis=-1, keepdims=True)
            middle = middle * np.polynomial.polynomial.polyval(r, _PLAIN_FIT)
        else:
            middle = normalise(middle)
        return quadratic(*(operand(normal, halfway) for normal in (left, middle, right)), t)

    return found


def _line(operand: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Operand:
    return lambda left, right, halfway, t: operand(interpolate("linear", left, right, t), halfway)


WAYS: dict[str, Operand] = {
    "chord, 3 points": _three_points(half_chord),
    "chord, line": _line(half_chord),
    "dot product, 3 points": _three_points(one_minus_dot),
    "dot product, line": _line(one_minus_dot),
    "dot product, 3 points, plain fit": _three_points(one_minus_dot, plain=True),
    "chord, 3 points, plain fit": _three_points(half_chord, plain=True),
}
"""Ways from the ends of a span to 1 - N·H of its pixels."""


def random_spans(exponent: int, degrees: float, count: int = _SPANS) -> tuple[np.ndarray, ...]:
    """Ends of random spans of an angle, and of each an H by which some of it is in the highlight.

    H stands over a place of the span's great circle, up to twice the highlight's width before or behind the
    span, and up to as much beside it.
    """
    rng = np.random.default_rng(1)
    angle, width = math.radians(degrees), 2 / math.sqrt(exponent)
    left, across = rng.normal(size=(2, count, 3))
    left = normalise(left)
    across = normalise(across - (across * left).sum(axis=1, keepdims=True) * left)
    along = rng.uniform(-width, angle + width, (count, 1))
    beside = rng.uniform(-width, width, (count, 1))
    over = np.cos(along) * left + np.sin(along) * across
    halfway = np.cos(beside) * over + np.sin(beside) * np.cross(left, across)
    return left, math.cos(angle) * left + math.sin(angle) * across, halfway


def in_words(vectors: np.ndarray, words: str) -> np.ndarray:
    """Vectors with components rounded to 16 fraction bits, or as the project's codes."""
    return np.floor(vectors * 65536 + 0.5) / 65536 if words == "16 bits" else values(quantise(vectors))


def worst_errors(exponent: int, degrees: float, words: str = "16 bits") -> dict[str, float]:
    """Largest error of each way in LSB of a full channel, against exactly normalised interpolation."""
    left, right, halfway = (v[:, np.newaxis] for v in random_spans(exponent, degrees))
    exact = interpolate("normalised", left, right, _PLACES)
    exact = COSQUAD.reflect(1 - half_chord(exact, halfway), exponent)
    rounded = [in_words(v[:, 0], words)[:, np.newaxis] for v in (left, right)]
    found = {}
    for name, way in WAYS.items():
        # `reflect` takes cosines over 1 for 1.
        error = COSQUAD.reflect(1 - way(*rounded, halfway, _PLACES), exponent) - exact
        found[name] = 255 * float(np.abs(error).max())
    return found


def _errors() -> str:
    rows = []
    for exponent in (10, 100, 1000):
        for degrees in (1, 5, 10, 20):
            found = worst_errors(exponent, degrees)
            rows.append([str(exponent), f"{degrees}°", *(f"{error:.2g}" for error in found.values())])
    return table(["n", "psi", *WAYS], rows, 0)


def fit_error(model: ReflectionModel, exponent: int, degrees: float, beside: float = 0.0) -> float:
    """Largest error of the three-point fit in LSB, searched over places of H and of pixels.

    H stands at an angle from the middle, in the plane of the span, or ``beside`` it (radians).
    """
    half = math.radians(degrees) / 2
    reach = min(3 / math.sqrt(exponent) + half, 1.5)
    s, towards = np.linspace(-1, 1, 401)[:, np.newaxis], np.linspace(-reach, reach, 1601)

    def operand(angle):
        return 1 - math.cos(beside) + math.cos(beside) * 2 * np.sin((angle - towards) / 2) ** 2

    exact = operand(np.arctan(s * math.tan(half)))
    found = quadratic(*(operand(angle) for angle in (-half, 0.0, half)), (s + 1) / 2)
    return 255 * float(np.abs(model.reflect(1 - found, exponent) - model.reflect(1 - exact, exponent)).max())


def largest_fit_error(model: ReflectionModel, exponent: int, degrees: float) -> float:
    """The same with H beside the span by up to the highlight's width, too."""
    return max(fit_error(model, exponent, degrees, k / math.sqrt(exponent)) for k in (0, 0.1, 0.3, 1))


def steepness(model: ReflectionModel, exponent: int = 1000) -> float:
    """M: largest change of the model a radian, over sqrt(n)."""
    gamma = np.linspace(0, 6 / math.sqrt(exponent), 200_001)
    values = model.reflect(1 - 2 * np.sin(gamma / 2) ** 2, exponent)
    return float(np.abs(np.gradient(values, gamma)).max() / math.sqrt(exponent))


def leading_constant(model: ReflectionModel) -> float:
    """C of ``c sqrt(n) psi^3``, LSB, psi in radians."""
    return 255 * steepness(model) / (24 * math.sqrt(3))


_MODELS = ("cosquad", "cosquad7", "cosquad_lin", "lyon3", "exp", "blinn")


def _widest() -> str:
    rows = []
    for exponent in (1, 2, 5, 10, 100, 1000):
        widest = largest_span_angle(exponent)
        found = (largest_fit_error(REFLECTION_MODELS[name], exponent, widest) for name in _MODELS)
        # Ends of a span that reaches into the highlight; its base is 0 where u = 2/n.
        largest_u = min((2 / math.sqrt(exponent) + math.radians(widest)) ** 2 / 2, 2.0)
        words = 255 * exponent * word_errors(widest, largest_u)[0]
        rows.append([str(exponent), f"{widest:.2f}°", *(f"{error:.3f}" for error in found), f"{words:.3f}"])
    return table(["n", "psi_max", *(f"`{name}`" for name in _MODELS), "words"], rows, 0)


def word_errors(degrees: float, u: float) -> tuple[float, float]:
    """Bounds of the errors of u, up to a value, and of N·L by the words of values and setup."""
    chord = 2 * math.sin(math.radians(degrees) / 2)
    # |P| is the chord times the sine of the angle to H at most, and a bulge more.
    slope, curvature = np.array(chord * min(math.sqrt(2 * u), 1) + chord**2), np.array(chord**2)
    setup = ChordSetup()
    highlight = 1.25 * ChordValues.highlight_error(u) + setup.highlight_error(slope, curvature)
    diffuse = 1.25 * ChordValues.diffuse_error() + setup.diffuse_error(np.array(chord + chord**2), curvature)
    return float(highlight), float(diffuse)


def _arithmetic() -> str:
    rows = []
    for degrees in (1.0, 6.32, 9.28, 15.0):
        errors = [word_errors(degrees, u)[0] for u in (0.01, 0.1, 2.0)]
        diffuse = word_errors(degrees, 2.0)[1]
        rows.append([f"{degrees:g}°", *(f"{e:.1e}" for e in errors), f"{diffuse:.1e}"])
    return table(["psi", "u <= 0.01", "u <= 0.1", "any u", "N·L"], rows)


def fit_remainder(degrees: float) -> tuple[float, float]:
    """Largest share of its bound that the error of u reaches over all H; the bound for H over the middle."""
    half = math.radians(degrees) / 2
    tangent = math.tan(half)
    s, towards = np.linspace(-1, 1, 2001)[:, np.newaxis], np.linspace(-math.pi, math.pi, 721)
    exact = np.cos(np.arctan(s * tangent) - towards)
    fit = quadratic(*(np.cos(angle - towards) for angle in (-half, 0.0, half)), (s + 1) / 2)
    bound = (
        np.abs(np.sin(towards)) * tangent**3 / (3 * math.sqrt(3))
        + np.abs(np.cos(towards)) * tangent**4 * 3 / 32
    )
    return float((np.abs(exact - fit).max(axis=0) / bound).max()), tangent**4 * 3 / 32


def _true_normals(raster: Raster, origin: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Unit normals of spans with their lengths, at a pixel of each."""
    t = place / np.maximum(raster.length[origin] - 1, 1)
    left = raster.magnitude_left[origin] * (1 - t)
    right = raster.magnitude_right[origin] * t
    ends = raster.normal_left[origin], raster.normal_right[origin]
    return normalise(left[..., np.newaxis] * ends[0] + right[..., np.newaxis] * ends[1])


def pieces(scene: Scene, raster: Raster, true_middle: bool, tolerance: float = 0.25) -> np.ndarray:
    """Lengths of the pieces, if spans are halved until the three-point fit is right at nine places.

    Right is to be within a tolerance of the true normals' terms, in LSB at full reflection.
    """
    exponent = scene.materials[0].exponent
    light = np.asarray(scene.lights[0].direction)
    halfway = normalise(light + scene.camera.viewer)
    origin = np.flatnonzero(raster.length > 0)
    first, last = np.zeros(len(origin)), raster.length[origin] - 1.0
    done = []
    while len(origin):
        places = [first + (last - first) * k / 8 for k in range(9)]
        exact = [_true_normals(raster, origin, place) for place in places]
        middle = exact[4] if true_middle else normalise(exact[0] + exact[8])
        ends = exact[0], middle, exact[8]
        u = [half_chord(normal, halfway) for normal in ends]
        f = [normal @ light for normal in ends]
        wide = np.zeros(len(origin), dtype=bool)
        for k, normal in enumerate(exact):
            in_front = normal @ light > 0
            terms = COSQUAD.reflect(
                1 - np.array([half_chord(normal, halfway), quadratic(*u, k / 8)]), exponent
            )
            wide |= in_front & (255 * np.abs(terms[0] - terms[1]) > tolerance)
            wide |= in_front & (255 * np.abs(normal @ light - quadratic(*f, k / 8)) > tolerance)
        wide &= last - first > 2
        done.append((last - first + 1)[~wide])
        origin, first, last = origin[wide], first[wide], last[wide]
        half = np.floor((first + last + 1) / 2)
        origin = np.concatenate((origin, origin))
        first, last = np.concatenate((first, half)), np.concatenate((half - 1, last))
    return np.concatenate(done)


def _cuts() -> str:
    rows = []
    for triangles in (200, 1_000, 10_000):
        for exponent in (20, 100, 1000):
            scene = scene_for(teapot(triangles), exponent, 640, 480)
            raster = rasterise(scene)
            cut, _ = cut_spans(scene, raster, preset("chord", "cosquad"))
            row = [f"{len(scene.mesh.faces):,}", str(exponent), f"{len(raster.length):,}"]
            found = (cut.length, pieces(scene, raster, False), pieces(scene, raster, True))
            for lengths in found:
                cycles = np.maximum(lengths, 4).sum() / raster.length.sum()
                row.append(f"{len(lengths) / len(raster.length):.2f}, {cycles:.3f}")
            rows.append(row)
    head = ["triangles", "n", "spans", "by angle and turn", "true normals, middle by h", "true middle"]
    return table(head, rows, 0)


def shifted_error(exponent: int, degrees: float, ratio: float, true_middle: bool) -> float:
    """Error of the fit through a span whose right end is ``ratio`` times as long, worst place of H, LSB."""
    half = math.radians(degrees) / 2
    reach = 3 / math.sqrt(exponent) + half
    t, towards = np.linspace(0, 1, 401)[:, np.newaxis], np.linspace(-reach, reach, 1601)

    def angle(t):
        moved = t * ratio / (1 - t + t * ratio)
        return np.arctan((2 * moved - 1) * math.tan(half))

    def operand(angle):
        return 2 * np.sin((angle - towards) / 2) ** 2

    ends = operand(-half), operand(angle(0.5) if true_middle else 0.0), operand(half)
    exact, found = operand(angle(t)), quadratic(*ends, t)
    return 255 * float(
        np.abs(COSQUAD.reflect(1 - found, exponent) - COSQUAD.reflect(1 - exact, exponent)).max()
    )


def _magnitudes() -> str:
    rows = []
    for exponent in (10, 100, 1000):
        for ratio in (1.01, 1.1, 1.5):
            row = [str(exponent), f"{ratio:g}"]
            widest = largest_span_angle(exponent)
            shift = (math.sqrt(ratio) - 1) / (math.sqrt(ratio) + 1)
            row.append(f"{255 * steepness(COSQUAD) * math.sqrt(exponent) * math.radians(widest) * shift:.1f}")
            row += [f"{shifted_error(exponent, widest, ratio, true):.2f}" for true in (False, True)]
            rows.append(row)
    return table(["n", "m_r / m_l", "estimate", "middle by h", "true middle"], rows, 0)


def _sentences() -> list[str]:
    shares = [fit_remainder(d)[0] for d in (1, 5, 15, 45)]
    assert max(shares) <= 1 + 1e-6
    c, m = leading_constant(COSQUAD), steepness(COSQUAD)
    worst = max(
        largest_fit_error(REFLECTION_MODELS[name], n, largest_span_angle(n))
        for name in _MODELS
        for n in (1, 2, 3, 4, 5, 6, 7, 10, 20, 50, 100, 200, 500, 1000)
    )
    diffuse = 255 * math.tan(math.radians(7.5)) ** 3 / (3 * math.sqrt(3))
    assert m == max(steepness(model) for model in REFLECTION_MODELS.values() if not model.MIRROR)
    length = 255 * (1 - float(COSQUAD.reflect(1 - 1e-4, 1000)))
    chord_length = 255 * (1 - float(COSQUAD.reflect(1 - 1e-8 / 2, 1000)))
    own = [worst_errors(1000, 1, "codes")[name] for name in ("chord, 3 points", "dot product, 3 points")]
    seen = max(worst_errors(n, largest_span_angle(n))["chord, 3 points"] for n in (10, 100, 1000))
    bits = 255 * 1000 * 3 * 2.0**-17 / math.sqrt(3)
    return [
        f"M = {m:.4f}, so that c = 255 M / (24 sqrt 3) = {c:.2f} LSB",
        f"`c sqrt(n) psi_max^3` is {c * math.radians(20) ** 3:.3f} LSB",
        f"at most {worst:.3f} LSB",
        f"reaches {min(shares):.2f} to {max(shares):.2f} of this bound",
        f"{diffuse:.3f} LSB at 15°",
        f"costs {length:.1f} LSB at the peak of a highlight of n = 1000 by the dot product, "
        f"and {chord_length:.4f} LSB by the chord",
        f"{own[0]:.2f} LSB by the chord and {own[1]:.2f} LSB by the dot product",
        f"up to {bits:.1f} LSB",
        f"Up to psi_max the chord stays under {math.ceil(100 * seen) / 100:.2f} LSB",
    ]


_COLOURS = {"chord, 3 points": "#0072b2", "dot product, 3 points": "#d55e00", "dot product, line": "#999999"}


def figure() -> Figure:
    """Largest error against span angle, for three exponents."""
    style = {"font.size": 8, "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.5}
    angles = np.geomspace(0.1, 30, 31)
    with rc_context(style):
        drawing = Figure(figsize=(9, 3.4), layout="constrained")
        for panel, exponent in zip(drawing.subplots(1, 3, sharey=True), (10, 100, 1000), strict=True):
            found = [worst_errors(exponent, degrees) for degrees in angles]
            for name, colour in _COLOURS.items():
                panel.loglog(angles, [errors[name] for errors in found], color=colour, label=name)
            fit = leading_constant(COSQUAD) * math.sqrt(exponent) * np.radians(angles) ** 3
            panel.loglog(angles, fit, color="black", linestyle=":", label="c sqrt(n) psi^3")
            panel.axvline(largest_span_angle(exponent), color="#009e73", linestyle="--", label="psi_max")
            panel.set(title=f"n = {exponent}", xlabel="span angle, degrees", ylim=(1e-3, 300))
            panel.minorticks_off()
            panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
            panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        drawing.axes[0].set_ylabel("largest error, LSB")
        drawing.legend(*drawing.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return drawing


def svg() -> str:
    """The figure, the same text every time."""
    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "blysk"}):
        figure().savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, facecolor="white")
    return "\n".join(line.rstrip() for line in buffer.getvalue().splitlines()) + "\n"


def _fading_lights(mesh: Mesh) -> dict[str, Light]:
    """Point lights above a mesh: as bright everywhere, fading by the distance, and spots at its middle."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, far = (low + high) / 2, 0.9 * np.linalg.norm(high - low)
    place = middle + far * normalise(np.array([-0.5, 0.8, 0.7]))
    bare = Light(position=tuple(place))
    spot = replace(bare, spot=tuple(middle - place), cone=(10, 20))
    by_distance = replace(bare, color=(4.0,) * 3, attenuation=(1.0, 0.0, 15 / far**2))
    return {
        "point light": bare,
        "by distance": replace(bare, attenuation=(0.0, 0.0, 1 / (0.4 * far) ** 2)),
        "spot": spot,
        "narrow border": replace(spot, cone=(8, 9)),
        "both, 4 times white": replace(by_distance, spot=spot.spot, cone=spot.cone),
    }


def _factors() -> str:
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    flat = Mesh(square, faces, np.tile([0.0, 1.0, 0.0], (4, 1)), material=np.zeros(2, np.int64))
    rows = []
    for name, mesh in {
        "teapot, 992": teapot(1_000),
        "teapot, 10,712": teapot(10_000),
        "square, 2": flat,
    }.items():
        lights = _fading_lights(mesh)
        for projection in ("perspective", "orthographic"):
            camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), projection, 4 / 3)
            row = [name, projection]
            for light in lights.values():
                design = preset("chord-local", "blinn", factors=(0,) if light.fades else ())
                errors, cuts = [], {}
                for exponent in (1, 50, 1000):
                    scene = replace(scene_for(mesh, exponent, 320, 240), lights=(light,), camera=camera)
                    frame = model_frame(scene, design)
                    errors.append(compare(scene, design, frame).total_error.max_lsb)
                    cuts[exponent] = frame.spans / len(frame.raster.length)
                row.append(f"{max(errors):.2f}, {cuts[50]:.2f}")
            rows.append(row)
    return table(["mesh, triangles", "projection", *lights], rows, 2)


TABLES: dict[str, Callable[[], str]] = {
    "chord-factors": _factors,
    "chord-errors": _errors,
    "chord-widest": _widest,
    "chord-arithmetic": _arithmetic,
    "chord-cuts": _cuts,
    "chord-magnitudes": _magnitudes,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {"chord.md": _sentences}
FIGURES: dict[str, Callable[[], str]] = {"chord-error.svg": svg}
