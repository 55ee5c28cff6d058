"""Cycles a pixel of teapot frames, by the lengths of their spans and the setup interval.

``python -m blysk.bench.speed.throughput [TRIANGLES ...]`` draws teapots of 1,000, 10,000, 100,000 and
1,000,000 triangles at 1920x1080, and sends their spans through the simulated pipelines of the methods
quotient, renormalise and quadratic, with those of the setup intervals 1, 2, 3, 4, 7 and 9 that each method
has. It prints two tables in Markdown: lengths of the spans, and cycles. ``--json`` prints the same as JSON.
The exit status is 1 if spans of 16 pixels or more take over 1.05 cycles a pixel.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.command import progress
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import constants_of, prepare
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.teapot import teapot

__all__ = ["BINS", "INTERVALS", "LARGEST", "LONG", "METHODS", "TRIANGLES", "Lengths", "Throughput"]
__all__ += ["main", "measure", "spans_of"]

TRIANGLES = (1_000, 10_000, 100_000, 1_000_000)
METHODS = ("quotient", "renormalise", "quadratic")
INTERVALS = (1, 2, 3, 4, 7, 9)
"""Setup intervals to measure; for each method, those that it can be built for."""

BINS = (1, 2, 3, 4, 8, 16, 32)
"""Shortest span of each class of the table."""

LONG = 16
"""Least length, in pixels, of the long spans, which have a target."""

LARGEST = 1.05
"""Target: most cycles a pixel of long spans."""

_EXPONENT = 50


@dataclass(frozen=True)
class Lengths:
    """Lengths of the spans of a frame, after spans that are too wide for the method are cut.

    Parameters
    ----------
    triangles : int
        Triangles of the mesh.
    method : str
        Method of interpolation.
    spans, pixels : int
        Numbers of spans and of pixels.
    span_share, pixel_share : tuple of float
        Share of the spans, and of the pixels, in each class of `BINS`.
    """

    triangles: int
    method: str
    spans: int
    pixels: int
    span_share: tuple[float, ...]
    pixel_share: tuple[float, ...]

    @classmethod
    def of(cls, triangles: int, method: str, length: np.ndarray) -> "Lengths":
        """Lengths of a frame from its spans' lengths, none 0."""
        length = np.asarray(length, dtype=np.int64)
        which = np.searchsorted(BINS, length, side="right") - 1
        pixels = int(length.sum())
        shares = (
            np.bincount(which, weights, minlength=len(BINS)) / max(total, 1)
            for weights, total in ((None, len(length)), (length, pixels))
        )
        return cls(triangles, method, len(length), pixels, *(tuple(share.tolist()) for share in shares))


@dataclass(frozen=True)
class Throughput:
    """Cycles of a frame through the simulated pipeline.

    Parameters
    ----------
    triangles : int
        Triangles of the mesh.
    method : str
        Method of interpolation.
    setup_interval : int or None
        Least cycles from one span to the next; ``None`` for a method with one setup interval.
    pixels, cycles : int
        Pixels of the frame, and cycles from the first write of a constant to the last pixel.
    long_pixels, long_cycles : int
        The same numbers of a run with only the spans of `LONG` pixels or more.
    """

    triangles: int
    method: str
    setup_interval: int | None
    pixels: int
    cycles: int
    long_pixels: int
    long_cycles: int

    @property
    def cycles_per_pixel(self) -> float:
        """Cycles a pixel; NaN without pixels."""
        return self.cycles / self.pixels if self.pixels else float("nan")

    @property
    def setup_share(self) -> float:
        """Share of the cycles without an output pixel: setup, constants and latency."""
        return 1 - self.pixels / self.cycles

    @property
    def long_cycles_per_pixel(self) -> float | None:
        """Cycles a pixel of long spans; ``None`` where there are none."""
        return self.long_cycles / self.long_pixels if self.long_pixels else None


def spans_of(scene: Scene, method: str) -> Spans:
    """Spans of a scene, cut and quantised for a method."""
    return prepare(scene, preset(method, model_of(method))).spans


def measure(
    unit: ShadingPipelineUnit, spans: Spans, constants: FrameConstants, engine: str = "cxxrtl"
) -> tuple[int, int]:
    """Pixels of spans, and the cycles that they take without stalls, both counted at the unit's output.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        Pipeline of one material.
    spans : Spans
        Spans, none of them empty.
    constants : FrameConstants
        Constants that are written first; their writes count as cycles.
    engine : str
        As `simulate` takes it.
    """
    if not len(spans):
        return 0, 0
    run = simulate(
        unit,
        beats_of(unit, spans),
        count=int(np.sum(spans.length)),
        write=constants.writes(),
        engine=engine,
    )
    return len(run.beats), run.total_cycles


def _intervals_of(method: str, intervals: Sequence[int]) -> Sequence[int | None]:
    """Those of ``intervals`` that a method can be built for; ``None`` if it has no choice."""
    interpolator = preset(method, model_of(method)).interpolator
    served = unit_of(interpolator).setup_intervals(interpolator)
    return [i for i in intervals if i in served] if served else [None]


def _frames(
    triangles: Iterable[int], methods: Sequence[str], intervals: Sequence[int], width: int, height: int
) -> Iterator[tuple[Lengths, list[Throughput]]]:
    served = {method: _intervals_of(method, intervals) for method in methods}
    units = {
        (method, interval): ShadingPipelineUnit(preset(method, model_of(method), setup_interval=interval))
        for method in methods
        for interval in served[method]
    }
    for count in triangles:
        mesh = teapot(count)
        scene = scene_for(mesh, _EXPONENT, width, height)
        for method in methods:
            (constants,) = constants_of(scene, preset(method, model_of(method)))
            spans = spans_of(scene, method)
            chosen = np.asarray(spans.length) >= LONG
            long = spans[chosen]
            yield (
                Lengths.of(len(mesh.faces), method, spans.length),
                [
                    Throughput(
                        *(len(mesh.faces), method, interval),
                        *measure(units[method, interval], spans, constants),
                        *measure(units[method, interval], long, constants),
                    )
                    for interval in served[method]
                ],
            )


def _print(lengths: Sequence[Lengths], rows: Sequence[Throughput], width: int, height: int) -> None:
    classes = [str(low) if high == low + 1 else f"{low}-{high - 1}" for low, high in pairwise(BINS)]
    classes.append(f"{BINS[-1]}+")
    print(f"Teapot at {width}x{height}: share of the spans / of the pixels, by pixels of the span.\n")
    print(f"| triangles | method | spans | pixels | {' | '.join(classes)} |")
    print(f"|---:|---|---:|---:|{'---:|' * len(classes)}")
    for row in lengths:
        shares = zip(row.span_share, row.pixel_share, strict=True)
        cells = " | ".join(f"{spans:.1%} / {pixels:.1%}" for spans, pixels in shares)
        print(f"| {row.triangles:,} | {row.method} | {row.spans:,} | {row.pixels:,} | {cells} |")
    print("\nClocks of the simulated pipeline, one light.\n")
    print(f"| triangles | method | setup interval | cycles | a pixel | setup | a pixel, spans of {LONG}+ |")
    print("|---:|---|---:|---:|---:|---:|---:|")
    for row in rows:
        long = "-" if row.long_cycles_per_pixel is None else f"{row.long_cycles_per_pixel:.4f}"
        print(
            f"| {row.triangles:,} | {row.method} | {row.setup_interval or '-'} | {row.cycles:,} "
            f"| {row.cycles_per_pixel:.3f} | {row.setup_share:.1%} | {long} |"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables, and compare with the target.

    Returns
    -------
    int
        0, or 1 when long spans take too many cycles.
    """
    parser = argparse.ArgumentParser(
        prog="blysk.bench.speed.throughput", description="cycles a pixel of real frames"
    )
    parser.add_argument("triangles", nargs="*", type=int, default=TRIANGLES)
    parser.add_argument("--width", type=int, default=1920)
    parser.add_argument("--height", type=int, default=1080)
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--intervals", nargs="+", type=int, default=INTERVALS)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    lengths: list[Lengths] = []
    rows: list[Throughput] = []
    frames = _frames(options.triangles, options.methods, options.intervals, options.width, options.height)
    for frame, throughputs in progress(frames, total=len(options.triangles), unit="meshes"):
        lengths.append(frame)
        rows += throughputs
    if options.json:
        figures = [
            asdict(row)
            | {
                "cycles_per_pixel": row.cycles_per_pixel,
                "setup_share": row.setup_share,
                "long_cycles_per_pixel": row.long_cycles_per_pixel,
            }
            for row in rows
        ]
        json.dump({"bins": BINS, "lengths": [asdict(row) for row in lengths], "cycles": figures}, sys.stdout)
        print()
    else:
        _print(lengths, rows, options.width, options.height)
    slow = [row for row in rows if (row.long_cycles_per_pixel or 0) > LARGEST]
    for row in slow:
        print(
            f"missed: {row.long_cycles_per_pixel:.4f} cycles a pixel, spans of {LONG}+: {row.method}, "
            f"setup interval {row.setup_interval}, {row.triangles:,} triangles",
            file=sys.stderr,
        )
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
