"""The industry's rules of rasterisation, written anew as tests of the golden rasteriser and of the geometry.

The geometry has models and RTL. The RTL equals the models bit for bit, and a part of the rules runs on it.

- Khronos' fill rule: pixels of a shared edge are drawn once. The cases are those of its conformance tests
  (VK-GL-CTS, `functional.rasterization.fill_rules`): basic, reversed, clipped in part and in full, projected.
- Khronos' verifier: a pixel wholly inside a triangle is drawn, and a pixel wholly outside is not.
- piglit's idea: random triangles against a fixed-point rasteriser. This one has eight fill conventions, and
  the models have to hold exactly one of the eight, the top-left rule of Direct3D 11.
"""

from itertools import product

import numpy as np
import pytest

from .coverage import SIDE, by_geometry, by_rasteriser, by_rtl, in_cells, tags_of

MODELS = [by_geometry, by_rasteriser]
RTL = pytest.param(by_rtl, marks=[pytest.mark.long, pytest.mark.ci])
SIZE = 96, 80


def halves(quads, reverse):
    """Two triangles of each quad, shape (2 Q, 3, 2). With ``reverse`` one of them turns the other way."""
    second = [0, 3, 2] if reverse else [0, 2, 3]
    return np.stack([quads[:, [0, 1, 2]], quads[:, second]], axis=1).reshape(-1, 3, 2)


def turned(angle, radius, centre):
    """Corners of a square in steps, rounded to the grid."""
    corner = np.radians(angle + 90 * np.arange(4))
    return np.rint((np.stack([np.cos(corner), np.sin(corner)], axis=-1) * radius + centre) * 256).astype(int)


def in_perspective(rng):
    """Corners of a square that is turned in space, in steps."""
    spin, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) @ spin + (0, 0, 2.2)
    return np.rint((corners[:, :2] / corners[:, 2:] * 40 + (48, 40)) * 256).astype(int)


def quads_of(case):
    """Quads of one of Khronos' cases; each is drawn by itself."""
    rng = np.random.default_rng(11)
    if case == "projected":
        return [in_perspective(rng) for _ in range(24)]
    radius = {"clipped in part": 70, "clipped in full": 900}.get(case, 36)
    centres = rng.uniform(30, 60, (24, 2))
    return [
        turned(angle, radius, centre) for angle, centre in zip(np.arange(0, 90, 3.75), centres, strict=True)
    ]


def inside(quad):
    """Pixels whose centre is well inside a convex quad, shape (rows, columns)."""
    y, x = (256 * np.indices(SIZE[::-1]) + 128).astype(float)
    found = []
    for (x0, y0), (x1, y1) in zip(quad, np.roll(quad, -1, axis=0), strict=True):
        found.append(((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / np.hypot(x1 - x0, y1 - y0))
    found = np.array(found)
    return (found.min(axis=0) > 1) | (found.max(axis=0) < -1)


@pytest.mark.parametrize("model", [*MODELS, RTL])
@pytest.mark.parametrize("case", ["basic", "reversed", "clipped in part", "clipped in full", "projected"])
def test_a_shared_edge_is_drawn_once(case, model):
    """No pixel of a quad is drawn twice, and none that is inside is missed."""
    edges = 0
    for quad in quads_of(case):
        corners = halves(quad[np.newaxis], case == "reversed")
        count = model(corners, np.array([1, 2]), SIZE)[0]
        within = inside(quad)
        assert count.max() == 1
        assert (count[within] == 1).all()
        edges += within.sum()
    assert edges > 20_000


def signs(corners, columns, rows):
    """Signs of the edge functions at pixel centres, and the changes of each function to the right and down.

    Shapes (T, 3, rows, columns), (T, 3), (T, 3). Functions are positive inside.
    """
    (ax, ay), (bx, by) = (np.moveaxis(corners[:, k] - corners[:, 0], -1, 0) for k in (1, 2))
    area = ax * by - ay * bx
    ordered = np.where((area < 0)[:, np.newaxis, np.newaxis], corners[:, ::-1], corners)
    x0, y0 = np.moveaxis(ordered, -1, 0)
    x1, y1 = np.moveaxis(np.roll(ordered, -1, axis=1), -1, 0)
    right, down = y0 - y1, x1 - x0
    x, y = (256 * np.arange(n) + 128 for n in (columns, rows))
    value = right[..., np.newaxis, np.newaxis] * (x - x0[..., np.newaxis, np.newaxis]) + down[
        ..., np.newaxis, np.newaxis
    ] * (y[:, np.newaxis] - y0[..., np.newaxis, np.newaxis])
    # A triangle without area covers nothing.
    value[area == 0] = -1
    return np.sign(value), np.sign(right), np.sign(down)


CONVENTIONS = list(product((1, -1), (1, -1), (True, False)))
"""Where a centre on an edge counts as being: right or left, down or up, and which of both decides first."""


def filled(found, convention):
    """Pixels of triangles by a fill convention, shape (T, rows, columns)."""
    sign, right, down = found
    x, y, x_first = convention
    first, second = (x * right, y * down) if x_first else (y * down, x * right)
    tie = np.where(first != 0, first, second)[..., np.newaxis, np.newaxis]
    return (np.where(sign != 0, sign, tie) > 0).all(axis=1)


def mosaic(tiles, across):
    """Tiles of (T, rows, columns), side by side."""
    rows, columns = tiles.shape[1:]
    return tiles.reshape(across, across, rows, columns).swapaxes(1, 2).reshape(across * rows, -1)


@pytest.mark.parametrize(
    ("across", "models"),
    [
        (24, MODELS),
        pytest.param(64, MODELS, marks=[pytest.mark.long, pytest.mark.ci]),
        pytest.param(24, [by_rtl], marks=[pytest.mark.long, pytest.mark.ci]),
    ],
)
def test_one_of_eight_fill_conventions(across, models):
    """Models and RTL hold the top-left rule. Random triangles tell it from each of the other seven."""
    corners, tags = in_cells(np.random.default_rng(across), across)
    cell = np.stack(np.meshgrid(*[np.arange(across)] * 2), axis=-1).reshape(-1, 1, 2)
    found = signs(corners - 256 * SIDE * cell, SIDE, SIDE)
    size = (across * SIDE,) * 2
    drawn = [model(corners, tags, size)[0] for model in models]
    held = [
        convention
        for convention in CONVENTIONS
        if all((mosaic(filled(found, convention), across) == one).all() for one in drawn)
    ]
    assert held == [(1, 1, True)]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_convention_draws_a_shared_edge_once(convention):
    """So a consistent rule is no proof of the top-left rule: the eight differ only at ties."""
    quads = np.array([turned(angle, 6, (8, 8)) // 128 * 128 for angle in (0, 45, 30)])
    tiles = filled(signs(halves(quads, False), SIDE, SIDE), convention)
    assert tiles.reshape(3, 2, SIDE, SIDE).sum(axis=1).max() == 1


@pytest.mark.parametrize("model", [*MODELS, RTL])
def test_triangles_at_a_pixel_centre(model):
    """piglit's fixed cases: four right angles at a centre, moved by a step each way. One of four has it."""
    step, size, middle = 256 // 16, 3 * 16, 128
    for dx, dy in product((-step, 0, step), repeat=2):
        x, y = middle + dx, middle + dy
        corners = np.array(
            [[[x + sx * size, y], [x, y + sy * size], [x, y]] for sx, sy in product((1, -1), repeat=2)]
        )
        # The centre is inside of the four together, on their edges, or beside them.
        assert model(corners, np.arange(1, 5), (4, 4))[0, 0, 0] == 1


@pytest.mark.parametrize("across", [16, pytest.param(48, marks=[pytest.mark.long, pytest.mark.ci])])
def test_pixels_wholly_inside_and_wholly_outside(across):
    """Khronos' verifier: the whole pixel, grown by a step of the grid, decides."""
    corners, tags = in_cells(np.random.default_rng(5), across)
    cell = np.stack(np.meshgrid(*[np.arange(across)] * 2), axis=-1).reshape(-1, 1, 2)
    home = corners - 256 * SIDE * cell
    shifts = [np.array(shift) for shift in product((-129, 129), repeat=2)]
    sides = np.stack([signs(home + shift, SIDE, SIDE)[0] for shift in shifts])
    whole = mosaic((sides > 0).all(axis=(0, 2)), across)
    none = mosaic((sides < 0).all(axis=0).any(axis=1), across)
    for model in MODELS:
        count = model(corners, tags, (across * SIDE,) * 2)[0]
        assert count[whole].all()
        assert not count[none].any()
    assert whole.sum() > 20 * across
    assert none.sum() > 20 * across


def test_overlapping_triangles_keep_every_pixel():
    """The geometry's models draw each triangle by itself, whatever lies behind it."""
    rng = np.random.default_rng(7)
    corners = rng.integers(0, 256 * SIDE + 1, (60, 3, 2))
    found = filled(signs(corners, SIDE, SIDE), (1, 1, True))
    tags = tags_of(rng, 60)
    count, total = by_geometry(corners, tags, (SIDE, SIDE))
    np.testing.assert_array_equal(count, found.sum(axis=0))
    np.testing.assert_array_equal(total, (found * tags[:, np.newaxis, np.newaxis]).sum(axis=0))
