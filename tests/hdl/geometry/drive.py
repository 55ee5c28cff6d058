"""How the units of geometry are driven and held against their models."""

from collections.abc import Mapping

import numpy as np

from blysk.golden.geometry.triangles import GRID, Frame, Triangles
from blysk.sim.engines.simulate import simulate

__all__ = ["STALLS", "assert_equal", "corners", "equals_model", "random_triangles"]

STALLS = ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9))
"""Shares of the cycles on which source and sink pause."""

FEW = 30
"""Beats that Amaranth's simulator is given, too."""


def take(beats, count):
    if isinstance(beats, Mapping):
        return {name: take(value, count) for name, value in beats.items()}
    return beats[:count]


def length_of(beats) -> int:
    return length_of(next(iter(beats.values()))) if isinstance(beats, Mapping) else len(beats)


def assert_equal(actual, expected, path="beat"):
    if isinstance(expected, Mapping):
        for name, value in expected.items():
            assert_equal(actual[name], value, f"{path}.{name}")
    else:
        np.testing.assert_array_equal(actual, expected, err_msg=path)


def equals_model(unit, beats, expected, *, constants=None, status=None, few=FEW, seed=2026):
    """Hold a unit against its model: every beat and counter, under stalls, cycle by cycle in two engines.

    Returns the run without stalls.
    """
    rng = np.random.default_rng(seed)
    count = length_of(expected)
    free = None
    for shares in (None, *STALLS):
        stalls = {}
        if shares is not None:
            names = ("input_stalls", "output_stalls")
            stalls = {
                name: rng.random(997 + 12 * k) < share
                for k, (name, share) in enumerate(zip(names, shares, strict=True))
            }
        run = simulate(unit, beats, count=count, constants=constants, engine="auto", **stalls)
        assert_equal(run.beats, expected)
        if status is not None:
            assert {name: int(run.status[name]) for name in status} == status
        free = free or run
        if few:
            slow, fast = (
                simulate(
                    unit,
                    take(beats, few),
                    count=None,
                    constants=constants,
                    engine=engine,
                    idle_timeout=600,
                    **stalls,
                )
                for engine in ("pysim", "auto")
            )
            for name in ("beats", "cycles", "input_cycles"):
                np.testing.assert_array_equal(getattr(slow, name), getattr(fast, name))
    return free


def corners(rng: np.random.Generator, count: int, grid=GRID, size: float = 12.0) -> np.ndarray:
    """Corners (count, 3, 2) of all kinds, around the middle of the grid: of so many pixels, in its steps."""
    step, reach = grid.steps, int(size * grid.steps)
    middle = rng.integers(-20 * step, 20 * step, (count, 1, 2))
    points = middle + rng.integers(-reach, reach + 1, (count, 3, 2))
    kind = rng.integers(0, 12, count)
    # On pixel centres, and on borders of pixels.
    half = kind == 1
    points[half] = points[half] // grid.half * grid.half
    # Needles: the third corner next to the line through the others.
    thin = kind == 2
    share = rng.integers(0, 9, (count, 1))
    points[thin, 2] = (
        points[:, 0] + (points[:, 1] - points[:, 0]) * share // 8 + rng.integers(-1, 2, (count, 2))
    )[thin]
    # Horizontal and vertical edges, no area, one point.
    points[kind == 3, 1, 1] = points[kind == 3, 0, 1]
    points[kind == 4, 2, 0] = points[kind == 4, 0, 0]
    points[kind == 5, 2] = points[kind == 5, 1]
    # Tiny ones, and ones that reach to the ends of the guard band.
    tiny = kind == 6
    points[tiny] = (middle + rng.integers(-step, step + 1, (count, 3, 2)))[tiny]
    low, high = grid.coordinate.min_code, grid.coordinate.max_code
    huge = (kind == 7) & (rng.random(count) < 0.2)
    points[huge] = rng.integers(low, high + 1, (int(huge.sum()), 3, 2))
    ends = (kind == 8) & (rng.random(count) < 0.2)
    points[ends] = rng.choice([low, high, 0, grid.half], (int(ends.sum()), 3, 2))
    return points


def random_triangles(
    rng: np.random.Generator, count: int, grid=GRID, size: float = 12.0, spread: float = 1.0
) -> Triangles:
    """Triangles of all kinds with normals so far from a common one, and depths."""
    points = corners(rng, count, grid, size)
    common = rng.normal(size=(count, 1, 3))
    normal = common / np.linalg.norm(common, axis=2, keepdims=True) + spread * rng.normal(size=(count, 3, 3))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    normal *= 2.0 ** -np.abs(rng.normal(size=(count, 3, 1)))
    ends = rng.random(count) < 0.05
    normal[ends] = rng.choice([-1.0, 0.0, 1.0], (int(ends.sum()), 3, 3))
    most = 2**23 - 1
    depth = rng.integers(0, 1 << 24, (count, 3))
    depth[::7] = rng.choice([0, (1 << 24) - 1], depth[::7].shape)
    return Triangles(
        x=points[..., 0],
        y=points[..., 1],
        depth=depth,
        normal=np.clip(np.rint(normal * 2**23), -most, most).astype(np.int64),
        material=rng.integers(0, 1024, count),
    )


def small_frame(rng: np.random.Generator, back_faces: str = "flip", limit: int = 267) -> Frame:
    """A picture of a few pixels, or of many, somewhere in the grid."""
    left, top = rng.integers(-24, 0, 2)
    right, bottom = rng.integers(1, 24, 2)
    return Frame(int(left), int(top), int(right), int(bottom), back_faces, limit)
