"""The report's section on [T]: its speed claims in software and in hardware, its table 1.1, and its MNSE."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.cosine_quadratic import panels
from blysk.bench.report.errata import FACTOR_PRINTED, ROOT_PRINTED
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.speed.renderer import timed
from blysk.bench.speed.throughput import measure, spans_of
from blysk.bench.store import Task
from blysk.bench.tools.blocks import BLOCKS, row_of
from blysk.bench.tools.fpga import TooLarge, lay_out, tool_versions
from blysk.bench.tools.pages import svg
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.metrics import error_figures, mnse_published, nmse
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "CLAIMS",
    "DEVICES",
    "SPANS",
    "WAYS",
    "Claim",
    "Counted",
    "clock_rate",
    "dot",
    "fastest",
    "frame_cycles",
    "hardware",
    "prices",
    "section",
    "shading_share",
    "software",
    "square_errors",
    "tasks",
]

SPANS = 4096
"""Spans that the ways in software work on together: few enough for their arrays to stay in a cache."""

_WIDEST = 45.0
_LENGTHS = (4, 8, 16, 32, 64, 128, 256)
_QUICK_LENGTHS = (8, 64)
_TRIANGLES = (1_000, 10_000, 100_000, 1_000_000)
_SHADINGS = ("gouraud", "phong")
_SEEDS = 3

# The ways in software. Each takes the spans' ends and L and H, as arrays of three rows, and gives one array
# after the other: the pixels of all spans at one place. The loops are over places in a span, where each value
# follows from the one before; all spans are worked on at once.

Way = Callable[[np.ndarray, np.ndarray, np.ndarray, int], Iterator[np.ndarray]]


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot products of columns, of arrays of three rows; operations that `Counted` counts."""
    product = a * b
    return product[0] + product[1] + product[2]


def _divided(vector: np.ndarray) -> np.ndarray:
    return vector / np.sqrt(dot(vector, vector))


def _scaled(vector: np.ndarray) -> np.ndarray:
    return vector * (1 / np.sqrt(dot(vector, vector)))


def _polynomial(coefficients: Sequence[float], x: np.ndarray) -> np.ndarray:
    """Horner's rule; coefficients in ascending order."""
    *rest, total = coefficients
    for coefficient in reversed(rest):
        total = total * x + coefficient
    return total


def _middle(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Middle normal by the h polynomial ([T] 2.2)."""
    return (left + right) * _polynomial(FACTOR_PRINTED, dot(left, right))


def _lines(normalised, left, right, vectors, pixels):
    step = (right - left) / (pixels - 1)
    vector = left
    for _ in range(pixels):
        yield normalised(vector)
        vector = vector + step


def _forward_differences(left, right, vectors, pixels):
    """[T] 2.2 and figure 2.10."""
    middle = 4 * _middle(left, right)
    dt = 1 / (pixels - 1)
    bend = (2 * (left + right) - middle) * dt
    first = (bend + (middle - right - 3 * left)) * dt
    second = 2 * dt * bend
    normal = left
    for _ in range(pixels):
        yield normal
        normal = normal + first
        first = first + second


def _middles(normalised, left, right, vectors, pixels):
    yield normalised(left + right)


def _middles_by_factor(left, right, vectors, pixels):
    yield _middle(left, right)


def _halves(half, left, right, pixels):
    """Normals between two others by bisection, from left to right; half takes both and the level."""
    levels = pixels.bit_length() - 1

    def between(left, right, level):
        if level == levels:
            return
        middle = half(left, right, level)
        yield from between(left, middle, level + 1)
        yield middle
        yield from between(middle, right, level + 1)

    return between(left, right, 0)


def _bisection_normalised(normalised, left, right, vectors, pixels):
    return _halves(lambda a, b, level: normalised(a + b), left, right, pixels)


def _bisection(left, right, vectors, pixels):
    """[T] 2.1: ``(N_a + N_b) p(z)``, ``z = 2 N_a·N_b``."""
    folded = [coefficient * 2.0**power for power, coefficient in enumerate(ROOT_PRINTED[2])]
    return _halves(lambda a, b, level: (a + b) * _polynomial(folded, dot(a, b)), left, right, pixels)


def _bisection_by_levels(left, right, vectors, pixels):
    """The same with one factor for all arcs of a level: ``z`` becomes ``sqrt(2 + z)``."""
    z = 2 * dot(left, right)
    factors = []
    for _ in range(pixels.bit_length() - 1):
        factors.append(_polynomial(ROOT_PRINTED[2], z))
        z = np.sqrt(2 + z)
    return _halves(lambda a, b, level: (a + b) * factors[level], left, right, pixels)


def _cosines_normalised(normalised, left, right, vectors, pixels):
    direction, halfway = vectors
    for normal in _lines(normalised, left, right, vectors, pixels):
        yield np.stack([dot(normal, direction), dot(normal, halfway)])


def _turn(left, right, vectors):
    """Angle across the spans, and of both vectors: cosines to the left end, and to what follows it."""
    cosine = dot(left, right)
    angle = np.arccos(cosine)
    first, last = (np.stack([dot(end, vector) for vector in vectors]) for end in (left, right))
    return angle, first, (last - cosine * first) / np.sin(angle)


def _cosines_by_angles(left, right, vectors, pixels):
    """[T] 3.1: ``cos beta cos(lambda - t psi)``."""
    angle, along, across = _turn(left, right, vectors)
    amplitude = np.sqrt(along * along + across * across)
    phase = np.arctan2(across, along)
    step = angle / (pixels - 1)
    for _ in range(pixels):
        yield amplitude * np.cos(phase)
        phase = phase - step


def _recurrence(left, right, vectors, pixels):
    """[T] 3.3: ``x(t+1) = 2 cos d x(t) - x(t-1)``."""
    angle, before, across = _turn(left, right, vectors)
    step = angle / (pixels - 1)
    cosine = np.cos(step)
    now = before * cosine + across * np.sin(step)
    twice = 2 * cosine
    for _ in range(pixels):
        yield before
        before, now = now, twice * now - before


_DIVIDED = "normalised, three divisions"
_SCALED = "normalised, one division"

WAYS: dict[str, Way] = {
    f"middle, {_DIVIDED}": partial(_middles, _divided),
    f"middle, {_SCALED}": partial(_middles, _scaled),
    "middle by h(r)": _middles_by_factor,
    f"bisection, {_DIVIDED}": partial(_bisection_normalised, _divided),
    f"bisection, {_SCALED}": partial(_bisection_normalised, _scaled),
    "bisection, a factor each": _bisection,
    "bisection, a factor a level": _bisection_by_levels,
    f"line, {_DIVIDED}": partial(_lines, _divided),
    f"line, {_SCALED}": partial(_lines, _scaled),
    "forward differences": _forward_differences,
    f"line, {_DIVIDED}, N·L and N·H": partial(_cosines_normalised, _divided),
    f"line, {_SCALED}, N·L and N·H": partial(_cosines_normalised, _scaled),
    "a cosine of each angle": _cosines_by_angles,
    "recurrence": _recurrence,
}
"""Ways to the normals, or to N·L and N·H, of a span's pixels: functions of both ends, (L, H) and the pixels.

Vectors are arrays of shape (3, spans), or (3, 1); a way gives an array of shape (3, spans), or of N·L and N·H
(2, spans), after the other.
"""


@dataclass(frozen=True)
class Claim:
    """A speed claim of [T].

    Parameters
    ----------
    name : str
        What is said to be faster.
    source : str
        Where.
    printed : float
        How many times.
    ways, rivals : tuple of str
        Of `WAYS`, to be compared each with each.
    devices, rival_devices : tuple of str
        The same in hardware, of `DEVICES`.
    in_pixels : bool
        Whether it depends on how long spans are.
    """

    name: str
    source: str
    printed: float
    ways: tuple[str, ...]
    rivals: tuple[str, ...]
    devices: tuple[str, ...]
    rival_devices: tuple[str, ...]
    in_pixels: bool = True


CLAIMS = (
    Claim(
        "bisection, polynomial of degree 2",
        "[T] 2.1",
        2.4,
        ("bisection, a factor each", "bisection, a factor a level"),
        (f"bisection, {_DIVIDED}", f"bisection, {_SCALED}"),
        ("bisection", "bisection interpolator"),
        ("renormaliser", "renormalise interpolator"),
    ),
    Claim(
        "middle normal, polynomial h",
        "[T] 2.2",
        2.5,
        ("middle by h(r)",),
        (f"middle, {_DIVIDED}", f"middle, {_SCALED}"),
        ("middle normal", "middle normal, one a clock"),
        ("renormaliser",),
        in_pixels=False,
    ),
    Claim(
        "forward differences of the normal",
        "[T] 2.2",
        3.6,
        ("forward differences",),
        (f"line, {_DIVIDED}", f"line, {_SCALED}"),
        ("forward differences", "quadratic interpolator"),
        ("renormaliser", "renormalise interpolator"),
    ),
    Claim(
        "spherical-angular recurrence",
        "[T] 3.3",
        1.7,
        ("recurrence",),
        (
            f"line, {_DIVIDED}, N·L and N·H",
            f"line, {_SCALED}, N·L and N·H",
            "a cosine of each angle",
        ),
        ("recurrence", "recurrence interpolator"),
        ("renormaliser", "renormalise interpolator"),
    ),
)
"""Speed claims of [T], all made for software."""

DEVICES = {
    "renormaliser": ("renormaliser", ""),
    "bisection": ("bisection", "2, 45"),
    "middle normal": ("middle_normal", "exact"),
    "middle normal, one a clock": ("middle_normal", "exact, interval 1"),
    "forward differences": ("difference_accumulator", ""),
    "recurrence": ("recurrence", "reinsch, interleaved"),
    "renormalise interpolator": ("linear_interpolator", "renormalise"),
    "bisection interpolator": ("bisection_interpolator", "bisection"),
    "quadratic interpolator": ("quadratic_interpolator", "quadratic"),
    "recurrence interpolator": ("recurrence_interpolator", "recurrence"),
}
"""Device and variant of the table of ``blysk blocks``. An interpolator has its setup with it, and gives N·L
and N·H; the others are the unit of a pixel alone."""


class Counted(np.ndarray):
    """An array that counts the operations done with it, and with what comes of it, in `counts`.

    An operation on arrays counts once an element. Made by `Counted.of`.
    """

    counts: Counter[str]

    _KINDS: ClassVar[dict[str, str]] = {
        "multiply": "multiplications",
        "add": "additions",
        "subtract": "additions",
        "negative": "additions",
        "divide": "divisions",
        "sqrt": "roots",
        "cos": "functions",
        "sin": "functions",
        "arccos": "functions",
        "arctan2": "functions",
        "power": "functions",
        "maximum": "comparisons",
    }

    @classmethod
    def of(cls, values: np.ndarray, counts: Counter[str]) -> "Counted":
        """Values that count in ``counts``: multiplications, additions (subtractions are), divisions, roots,
        functions, and comparisons.
        """
        counted = np.asarray(values, dtype=np.float64).view(cls)
        counted.counts = counts
        return counted

    def __array_finalize__(self, source):
        self.counts = getattr(source, "counts", Counter())

    def __array_function__(self, function, types, arguments, options):
        """Keep counting in what arrays are joined to."""
        result = super().__array_function__(function, types, arguments, options)
        return self.of(result, self.counts) if isinstance(result, np.ndarray) else result

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        """Count, and work on plain arrays."""
        plain = [x.view(np.ndarray) if isinstance(x, Counted) else x for x in inputs]
        counts = next(x.counts for x in inputs if isinstance(x, Counted))
        result = getattr(ufunc, method)(*plain, **options)
        counts[self._KINDS[ufunc.__name__]] += np.size(result)
        return self.of(result, counts)


def fastest(actions: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Least processor time of each of several actions, in seconds; run in turn, on the same machine then.

    Of all threads, as if they had to share one core; what other processes take does not count.

    Parameters
    ----------
    actions : sequence of callables
        What to time.
    repeats : int
        How often each.
    """
    times = [[timed(action, 1)[0].cpu for action in actions] for _ in range(repeats)]
    return np.min(times, axis=0).tolist()


def _operands(seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of random spans, up to `_WIDEST` degrees, and a unit L and H."""
    rng = np.random.default_rng(seed)
    left, across = rng.normal(size=(2, 3, SPANS))
    left = _divided(left)
    across = _divided(across - dot(across, left) * left)
    angle = np.radians(rng.uniform(0.1, _WIDEST, SPANS))
    vectors = rng.normal(size=(2, 3, 1))
    return left, left * np.cos(angle) + across * np.sin(angle), np.stack([_divided(v) for v in vectors])


def _all(way: Way, operands: tuple, pixels: int) -> None:
    for _ in way(*operands, pixels):
        pass


def software(way: str, rival: str, pixels: int, repeats: int) -> dict[str, Any]:
    """Two ways in software on the same spans: times as a ratio, operations a pixel, and how far they differ.

    Both are NumPy in float64, vectorised over `SPANS` random spans of up to 45 degrees, their setup included.

    Parameters
    ----------
    way, rival : str
        Of `WAYS`.
    pixels : int
        Pixels of each span: of a bisection, one more, a power of two.
    repeats : int
        Runs of each; the fastest counts.

    Returns
    -------
    dict
        ``ratio``: time of the rival over time of the way. ``operations``, ``rival_operations``: a result, by
        kind (see `Counted`). ``difference``: largest of a component of a normal, or of a cosine.
    """
    operands = _operands()
    pair = WAYS[way], WAYS[rival]
    operations = []
    for one in pair:
        counts: Counter[str] = Counter()
        found = sum(1 for _ in one(*(Counted.of(x, counts) for x in operands), pixels))
        operations.append({kind: count / (found * SPANS) for kind, count in counts.items()})
    results = zip(*(one(*operands, pixels) for one in pair), strict=True)
    difference = max(float(np.abs(ours - theirs).max()) for ours, theirs in results)
    # So many runs at once that a timing is no matter of microseconds.
    runs = max(1, 64 // pixels)
    time, rival_time = fastest(
        [lambda one=one: [_all(one, operands, pixels) for _ in range(runs)] for one in pair], repeats
    )
    return {
        "ratio": rival_time / time,
        "operations": operations[0],
        "rival_operations": operations[1],
        "difference": difference,
    }


def prices(repeats: int) -> dict[str, float]:
    """What a division, a root and a cosine cost in NumPy, in multiplications of as many numbers.

    Parameters
    ----------
    repeats : int
        Runs of each; the fastest counts.
    """
    x = np.random.default_rng(1).uniform(0.5, 1, SPANS)
    actions = {"a multiplication": lambda: x * x, "a division": lambda: x / x}
    actions |= {"a root": lambda: np.sqrt(x), "a cosine": lambda: np.cos(x)}
    # Many at once: one takes some microseconds.
    loops = [lambda action=action: [action() for _ in range(100)] for action in actions.values()]
    product, *times = fastest(loops, repeats)
    return {name: time / product for name, time in zip(list(actions)[1:], times, strict=True)}


def _block(name: str):
    device, variant = DEVICES[name]
    return next(block for block in BLOCKS if (block.device, block.variant) == (device, variant))


def hardware(name: str) -> dict[str, Any]:
    """Clocks and parts of a device of `DEVICES`.

    Returns
    -------
    dict
        ``latency`` and ``interval`` in cycles, ``cells``, ``multipliers``, ``register_bits``, and
        ``memory_bits``.
    """
    row = row_of(_block(name), None)
    return {
        "latency": row.latency,
        "interval": row.interval,
        **row.cost.totals,
    }


def clock_rate(name: str, seeds: int, tools: dict[str, str | None]) -> dict[str, Any]:
    """Clock rate of a device of `DEVICES` after place and route.

    Parameters
    ----------
    name : str
        The device.
    seeds : int
        Placements.
    tools : dict of str to str or None
        Versions of the tools, which the result depends on.

    Returns
    -------
    dict
        ``fmax``: median, MHz, or ``None``; ``reason`` why.
    """
    if None in tools.values():
        return {"fmax": None, "reason": "place and route is not installed: pip install 'blysk[fpga]'"}
    try:
        layout = lay_out(name, _block(name).unit(), seeds)
    except TooLarge as error:
        return {"fmax": None, "reason": str(error)}
    return {"fmax": layout.fmax[1], "reason": ""}


def frame_cycles(name: str, triangles: int, width: int, height: int) -> float:
    """Clocks a pixel of a frame in the simulated pipeline with an interpolator of `DEVICES`.

    Parameters
    ----------
    name : str
        The interpolator.
    triangles : int
        Of the teapot.
    width, height : int
        Size of the picture.
    """
    _, method = DEVICES[name]
    scene = scene_for(teapot(triangles), 50, width, height)
    unit = ShadingPipelineUnit(preset(method))
    pixels, cycles = measure(unit, spans_of(scene, method), FrameConstants.of(scene, 1))
    return cycles / pixels


def shading_share(triangles: int, width: int, height: int, repeats: int) -> dict[str, Any]:
    """Share of a frame's time that the golden renderer spends on shading, by Gouraud's and Phong's method.

    Parameters
    ----------
    triangles : int
        Of the teapot.
    width, height : int
        Size of the picture.
    repeats : int
        Runs of each part, in turn; the fastest count.

    Returns
    -------
    dict
        ``triangles`` and ``pixels``; ``gouraud`` and ``phong``: shading over rasterising and shading.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    raster = rasterise(scene)
    actions = [lambda: rasterise(scene)]
    actions += [
        lambda shading=shading: render(scene, shading, REFLECTION_MODELS["phong"], raster)
        for shading in _SHADINGS
    ]
    geometry, *times = fastest(actions, repeats)
    shares = {shading: time / (geometry + time) for shading, time in zip(_SHADINGS, times, strict=True)}
    return {"triangles": len(scene.mesh.faces), "pixels": int(raster.visible.sum()), **shares}


def square_errors(method: str, triangles: int, width: int, height: int) -> dict[str, Any]:
    """MNSE of a frame as [T] 4.1 prints it, and its well-posed form.

    The frame is that of the bit-true twin with the model cosquad, which the RTL equals to the bit; the
    reference is the exact one, Phong shading with Blinn's model; both over the pixels of the surface.

    Parameters
    ----------
    method : str
        One of `METHODS` or `PUBLISHED`.
    triangles : int
        Of the teapot.
    width, height : int
        Size of the picture.

    Returns
    -------
    dict
        ``nmse``, ``printed``, ``defined`` (share of values where the printed form is), ``max_lsb`` and
        ``p999_lsb``; ``nearest``: share of the printed form that the hundredth of the values nearest the mean
        makes; ``worst`` and ``least``: the printed form for the reference itself with 1 LSB more in one
        value, where it counts most and least, and ``one``: NMSE of either.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    design = preset(method)
    prepared = prepare(scene, design)
    color = design.compute(prepared.spans, FrameConstants.of(scene, 1)).color
    exact = render(scene, raster=prepared.raster)
    image = np.zeros((height * width, 3))
    seen = prepared.cut_raster.visible
    image[prepared.cut_raster.pixel[seen]] = color[seen]
    shown, reference = image[exact.mask.ravel()], exact.image[exact.mask] * 255
    errors = error_figures(shown[np.newaxis], reference[np.newaxis])
    printed, defined = mnse_published(shown, reference)
    distance = np.abs(reference - reference.mean()).ravel()
    order = np.argsort(distance)
    terms = np.square((shown - reference).ravel()[order] / distance[order])
    ones = []
    for place in (distance.argmin(), distance.argmax()):
        wrong = reference.copy().ravel()
        wrong[place] += 1
        ones.append((mnse_published(wrong, reference.ravel())[0], nmse(wrong, reference.ravel())))
    return {
        "nmse": nmse(shown, reference),
        "printed": printed,
        "defined": defined,
        "max_lsb": errors.max_lsb,
        "p999_lsb": errors.p999_lsb,
        "nearest": float(terms[: len(terms) // 100].sum() / terms.sum()),
        "worst": ones[0][0],
        "least": ones[1][0],
        "one": ones[0][1],
    }


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Few, of some seconds together: two lengths of span, the units of a pixel without place and route,
        small frames.
    """
    found = []
    for claim in CLAIMS:
        lengths = (_QUICK_LENGTHS if quick else _LENGTHS) if claim.in_pixels else (1,)
        settings = [
            {"way": way, "rival": rival, "pixels": pixels, "repeats": 15 if quick else 40}
            for way in claim.ways
            for rival in claim.rivals
            for pixels in lengths
        ]
        found += [Task(software, chosen, timed=True) for chosen in settings]
    found.append(Task(prices, {"repeats": 15 if quick else 40}, timed=True))
    size = {"width": 160, "height": 120} if quick else {"width": 640, "height": 480}
    devices = [name for name in DEVICES if not (quick and name.endswith("interpolator"))]
    found += [Task(hardware, {"name": name}) for name in devices]
    if not quick:
        rate = {"seeds": _SEEDS, "tools": tool_versions()}
        found += [Task(clock_rate, {"name": name, **rate}) for name in devices]
        whole = [name for name in devices if name.endswith("interpolator")]
        found += [Task(frame_cycles, {"name": name, "triangles": 10_000, **size}) for name in whole]
    found += [
        Task(shading_share, {"triangles": count, **size, "repeats": 7 if quick else 3}, timed=True)
        for count in (_TRIANGLES[:2] if quick else _TRIANGLES)
    ]
    methods = ("linear", "quadratic", "renormalise", "chord") if quick else (*METHODS, *PUBLISHED)
    count = 1_000 if quick else 10_000
    found += [Task(square_errors, {"method": method, "triangles": count, **size}) for method in methods]
    return found


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks.

    Parameters
    ----------
    tasks : sequence of Task
        As `tasks` gives them.
    results : sequence
        Their results.
    """
    by = {
        function: [
            (task.settings, result)
            for task, result in zip(tasks, results, strict=True)
            if task.function is function
        ]
        for function in (software, prices, hardware, clock_rate, frame_cycles, shading_share, square_errors)
    }
    speeds = _software_table(by[software])
    devices = {settings["name"]: {**result, "frame": None} for settings, result in by[hardware]}
    rates = {settings["name"]: result for settings, result in by[clock_rate]}
    for settings, result in by[frame_cycles]:
        devices[settings["name"]]["frame"] = result
    squares = _squares_table(by[square_errors])
    reached = [_reached(claim, speeds) for claim in CLAIMS]
    first, one = by[square_errors][0]
    turned = _turned(squares)
    text = [
        "[T] claims speed for four of its methods, each against classical normalisation, in software. "
        + " ".join(reached),
        "NumPy does an operation at a time on whole arrays, so that a root costs what its unit takes and no "
        "more: "
        + ", ".join(f"{kind} {cost:.2g}" for kind, cost in by[prices][0][1].items())
        + " multiplications on this machine. The table has the price from which on the counted operations "
        "alone would give the printed ratio, as on a machine whose roots cost so much.",
        "In hardware a unit that takes new operands on every clock gives a normal a clock whatever is "
        "inside, but for setups that take longer than a span: the claims turn into multipliers, cells and "
        "registers that are saved, not into cycles. The table of devices restates them so; a rival's figure "
        "over a device's is above 1 where the device is the cheaper.",
        "Table 1.1 of [T] has the share of shading in the time of a frame. Its printed values were not at "
        "hand; the table below shows what the golden renderer, in NumPy, takes for either method.",
        f"MNSE, as [T] 4.1 prints it, is defined for {one['defined']:.0%} of the values of the teapot's "
        "frame, and for few of a flat picture (see the errata). It divides by a pixel's own distance from "
        f"the mean: with the method `{first['method']}` the hundredth of the values that is nearest the "
        f"mean makes {one['nearest']:.0%} of it. The same single step of 1 LSB, in the reference frame "
        f"itself, gives {one['worst']:.2g} in the value nearest the mean and {one['least']:.2g} in the "
        f"farthest one, a ratio of {one['worst'] / one['least']:.2g}; NMSE says {one['one']:.2g} of both. "
        f"{turned}",
    ]
    parts = [
        speeds,
        _speed_drawing(by[software]),
        _operations_table(by[software]),
        _hardware_table(devices, rates),
        _ratios_table(devices, rates),
        _shares_table(by[shading_share]),
        squares,
    ]
    return Section("thesis", "Claims of [T]: speed, table 1.1, MNSE", text, parts)


_CLAIM_OF = {(way, rival): claim for claim in CLAIMS for way in claim.ways for rival in claim.rivals}


def _software_table(results: Sequence[tuple[dict, dict]]) -> Table:
    rows, grades = [], []
    for settings, result in results:
        claim = _CLAIM_OF[settings["way"], settings["rival"]]
        holds = result["ratio"] >= claim.printed
        rows.append(
            [
                *(claim.name, claim.source, settings["way"], settings["rival"]),
                settings["pixels"] if claim.in_pixels else None,
                *(claim.printed, result["ratio"], holds, _price(claim.printed, result), result["difference"]),
            ]
        )
        grade = "good" if holds else "fair" if result["ratio"] > 1 else "bad"
        grades.append([""] * 6 + [grade] * 2 + [""] * 2)
    return Table(
        "thesis-software",
        "Speed claims of [T] in software: how many times faster",
        (
            *("claim", "source", "way", "compared with", "pixels a span"),
            *("printed ratio", "measured ratio", "reaches it", "price of a root that reaches it"),
            "largest difference",
        ),
        rows,
        f"NumPy in float64, {SPANS} spans of up to {_WIDEST:g} degrees at once, setup included; both ways "
        "in turn in one run, the least processor time of several; a bisection has a pixel more. What [T] "
        "compared with is known as 'classical normalisation' only: both usual forms are here, and for the "
        "recurrence the direct evaluation "
        "of the cosines too. Price: what a root, a division or a cosine would have to cost, in "
        "multiplications or additions, for the counted operations alone to give the printed ratio. "
        "Difference: between the results of both, as components of a unit normal or cosines; a line's "
        "normals lie on another curve than the great circle, which is part of it. Green: the printed ratio "
        "is reached; yellow: faster, but less; red: slower.",
        grades,
    )


def _price(printed: float, result: dict[str, Any]) -> float | None:
    """Cost of a dear operation, in cheap ones, from which on the counts give the printed ratio."""
    cheap, dear = (
        [sum(result[of].get(kind, 0.0) for kind in kinds) for of in ("operations", "rival_operations")]
        for kinds in (_OPERATIONS[:2], _OPERATIONS[2:])
    )
    gain = dear[1] - printed * dear[0]
    return max((printed * cheap[0] - cheap[1]) / gain, 0.0) if gain > 0 else None


def _reached(claim: Claim, table: Table) -> str:
    rows = [row for row in table.records() if row["claim"] == claim.name]
    ratios = [row["measured ratio"] for row in rows]
    held = [row for row in rows if row["reaches it"]]
    text = (
        f"*{claim.name[0].upper()}{claim.name[1:]}*: printed {claim.printed}, "
        f"measured {min(ratios):.2f} to {max(ratios):.2f}, "
    )
    if len(held) == len(rows):
        return text + "reached everywhere."
    if not held:
        return text + "reached nowhere."
    against = sorted({row["compared with"] for row in held})
    where = f"reached in {len(held)} of {len(rows)} comparisons: against {' and '.join(against)}"
    lengths = sorted({row["pixels a span"] for row in held} - {None})
    return text + where + (f", on spans of {', '.join(map(str, lengths))} pixels." if lengths else ".")


def _speed_drawing(results: Sequence[tuple[dict, dict]]) -> Drawing:
    chosen = [claim for claim in CLAIMS if claim.in_pixels]
    figure, row = panels(9.6, 3.6, len(chosen), sharey=True)
    for claim, panel in zip(chosen, row, strict=True):
        for k, way in enumerate(claim.ways):
            for rival, colour in zip(claim.rivals, ("#0072b2", "#d55e00", "#009e73"), strict=False):
                curve = [
                    (settings["pixels"], result["ratio"])
                    for settings, result in results
                    if (settings["way"], settings["rival"]) == (way, rival)
                ]
                label = rival.removeprefix("bisection, ").removeprefix("line, ")
                label += f"; {way.removeprefix('bisection, ')}" if len(claim.ways) > 1 else ""
                panel.plot(
                    *zip(*curve, strict=True),
                    marker="os"[k],
                    linestyle=("-", "--")[k],
                    color=colour,
                    label=label,
                )
        panel.axhline(claim.printed, color="black", linestyle=":", label=f"printed, {claim.printed}")
        panel.axhline(1, color="#999999", linewidth=0.8)
        panel.set_xscale("log", base=2)
        panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panel.set_title(claim.name, fontsize=9)
        panel.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.2), frameon=False)
    row[0].set_ylabel("times faster than the rival")
    row[len(row) // 2].set_xlabel("pixels of a span")
    return Drawing(
        "thesis-speed",
        "Speed of the ways of [T] in software, against the length of a span",
        svg(figure),
        "Short spans pay for the setup. Below 1 a way is slower than its rival.",
    )


_OPERATIONS = ("multiplications", "additions", "divisions", "roots", "functions")


def _operations_table(results: Sequence[tuple[dict, dict]]) -> Table:
    found = {}
    for settings, result in results:
        found[settings["way"], settings["pixels"]] = result["operations"]
        found[settings["rival"], settings["pixels"]] = result["rival_operations"]
    order = {way: k for k, way in enumerate(WAYS)}
    single = {way for claim in CLAIMS if not claim.in_pixels for way in (*claim.ways, *claim.rivals)}
    rows = [
        [way, None if way in single else pixels, *(counts.get(kind, 0.0) for kind in _OPERATIONS)]
        for (way, pixels), counts in sorted(found.items(), key=lambda item: (order[item[0][0]], item[0][1]))
    ]
    return Table(
        "thesis-operations",
        "Operations in software, of a normal or of a pixel's N·L and N·H",
        ("way", "pixels a span", *_OPERATIONS),
        rows,
        "Counted while the ways run, the setup's share included; additions with subtractions; a product "
        "with a power of two counts; functions are cosines, sines and their inverses.",
    )


def _hardware_table(devices: dict[str, dict], rates: dict[str, dict]) -> Table:
    kinds = ("latency", "interval", "frame", "multipliers", "cells", "register_bits", "memory_bits")
    rows = [
        [name, *(figures[kind] for kind in kinds), rates.get(name, {}).get("fmax")]
        for name, figures in devices.items()
    ]
    reasons = sorted({result["reason"] for result in rates.values()} - {""})
    missing = " ".join(reasons) if rates else "The quick report has no place and route."
    return Table(
        "thesis-devices",
        "The same in hardware: devices",
        (
            *(
                "device",
                "latency, cycles",
                "interval, cycles",
                "cycles a pixel of a frame",
                "multipliers",
                "cells",
            ),
            *("register bits", "memory bits", "Fmax, MHz"),
        ),
        rows,
        "Interval: cycles from one result to the next. Cells, before technology mapping, are operators, "
        "multiplexers, registers and memories of any width. An interpolator is whole: setup, and N·L and N·H "
        "of one light; its frame is a teapot's, through the simulated pipeline, setups of spans included. "
        f"Fmax: median of placements on an ECP5-25F. {missing}".strip(),
    )


def _ratios_table(devices: dict[str, dict], rates: dict[str, dict]) -> Table:
    rows = []
    for claim in CLAIMS:
        pairs = [
            (name, rival)
            for name in claim.devices
            for rival in claim.rival_devices
            if name.endswith("interpolator") == rival.endswith("interpolator")
            and name in devices
            and rival in devices
        ]
        for name, rival in pairs:
            ours, theirs = devices[name], devices[rival]
            row = [claim.name, name, rival, claim.printed]
            for kind in ("interval", "frame", "multipliers", "cells", "register_bits"):
                row.append(theirs[kind] / ours[kind] if ours[kind] and theirs[kind] else None)
            rate, rival_rate = (rates.get(one, {}).get("fmax") for one in (name, rival))
            row.append(rate / rival_rate if rate and rival_rate else None)
            rows.append(row)
    return Table(
        "thesis-hardware",
        "Speed claims of [T] in hardware: the rival's figure over the device's",
        (
            *("claim", "device", "compared with", "printed ratio (software)", "cycles a result"),
            "cycles a pixel of a frame",
            *("multipliers", "cells", "register bits", "Fmax (device over rival)"),
        ),
        rows,
        "Above 1 the device of [T] needs less, or cycles faster. No figure: the device has no multiplier, or "
        "there is no place and route. The rival is the direct renormaliser, a normal a clock.",
    )


def _shares_table(results: Sequence[tuple[dict, dict]]) -> Table:
    return Table(
        "thesis-shading-share",
        "[T] table 1.1: share of shading in the time of a frame",
        ("shading", "triangles", "visible pixels", "share of shading"),
        [
            [shading, result["triangles"], result["pixels"], result[shading]]
            for shading in _SHADINGS
            for _, result in results
        ],
        "Teapot, golden renderer, Phong's model. The rest of the time is projection, rasterising, depth, "
        "and the normals at the ends of spans; pixels that are hidden are not shaded. The printed values "
        "were not at hand.",
    )


def _squares_table(results: Sequence[tuple[dict, dict]]) -> Table:
    return Table(
        "thesis-mnse",
        "MNSE as printed in [T] 4.1, and its well-posed form",
        (
            *("method", "MNSE as printed", "share of values where it is defined", "NMSE"),
            *("largest error, LSB", "99.9th percentile, LSB"),
        ),
        [
            [
                settings["method"],
                *(result[name] for name in ("printed", "defined", "nmse", "max_lsb", "p999_lsb")),
            ]
            for settings, result in results
        ],
        "Teapot, exponent 50, model cosquad, against Phong shading with Blinn's model, so mostly the model's "
        "error; frames of the bit-true twin, which the RTL equals to the bit. NMSE is "
        "`sum (I-O)^2 / sum (I-mean(I))^2`.",
    )


def _turned(squares: Table) -> str:
    """Two methods that the printed form puts in the other order than NMSE does."""
    rows = squares.records()
    for better in rows:
        for worse in rows:
            if (
                better["NMSE"] < worse["NMSE"]
                and better["largest error, LSB"] <= worse["largest error, LSB"]
                and better["MNSE as printed"] > worse["MNSE as printed"]
            ):
                return (
                    f"Among the methods it misleads, too: it puts `{worse['method']}` "
                    f"({worse['MNSE as printed']:.5g}) before `{better['method']}` "
                    f"({better['MNSE as printed']:.5g}), which has the smaller NMSE "
                    f"({better['NMSE']:.5g} against {worse['NMSE']:.5g}) and a largest error of "
                    f"{better['largest error, LSB']:.4g} against {worse['largest error, LSB']:.4g} LSB."
                )
    orders = [sorted(rows, key=lambda row: row[form]) for form in ("NMSE", "MNSE as printed")]
    if orders[0] == orders[1]:
        return "It puts these methods in the same order as NMSE does."
    return "It puts these methods in another order than NMSE does."
