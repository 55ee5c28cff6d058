"""Test of the centres in a triangle's box: whether a triangle with a small box covers no centre."""

from collections.abc import Callable, Sequence

from amaranth.hdl import Cat, Const, Mux, Signal, Value

from blysk.golden.geometry.triangles import Grid

__all__ = ["misses_centres", "near_bits"]


def near_bits(grid: Grid) -> int:
    """Bits of a signed distance in a box of up to four centres: it is under 5 pixels."""
    return grid.subpixel_bits + 4


def misses_centres(
    stage: Callable[[Value, str], Signal],
    grid: Grid,
    corner: Sequence[Value],
    differences: Sequence[Value],
    inclusive: Sequence[Value],
    box: Sequence[Sequence[Value]],
    total: Value,
) -> Value:
    """Whether a triangle has a box of 1 to 4 centres, and covers none of them. It is known 5 stages later.

    The edge functions at the box's first centre c are ``E01 = (y1 - y0) u - (x1 - x0) w`` and
    ``E20 = (x2 - x0) w - (y2 - y0) u`` with ``(u, w) = (x0, y0) - c``, and ``E12 = a - E01 - E20``. If an
    edge does not count for a > 0, its function is 1 smaller here. A centre is covered if the signs of all
    three functions are equal. At the other centres steps are added to the bits of whole pixels.

    Parameters
    ----------
    stage : callable
        Makes a register of the next stage from a value and a name.
    grid : Grid
        Fraction bits of the coordinates.
    corner : pair of Value
        Coordinates x0 and y0, the last `near_bits` bits.
    differences : sequence of Value
        ``x1 - x0``, ``x2 - x0``, ``y1 - y0``, ``y2 - y0``, the last `near_bits` bits.
    inclusive : sequence of Value
        Whether the edges from corner 0 to 1, from 1 to 2, and from 0 to 2 have their own points if a > 0.
    box : pair of pairs of Value
        First column and first column after the box, and the same for scanlines.
    total : Value
        a, three stages later.
    """
    bits, s = near_bits(grid), grid.subpixel_bits
    size = 2 * bits - 1

    def passed(words, name):
        return [
            [stage(word, f"{name}_{k}_{n}") for n, word in enumerate(edge)] for k, edge in enumerate(words)
        ]

    # Stage 4: columns and scanlines less 1, and the first corner as seen from the first centre.
    across, down = (high + ~low for low, high in box)
    few = ~across[:2].any() | ~down[:2].any() | ((across[:2] == 1) & (down[:2] == 1))
    tested = few & ~Cat(across[2:], down[2:]).any()
    tag = stage(Cat(across[:2], down[:2], tested, *inclusive), "near_tag_4")
    u, w = (
        stage((code - Cat(Const(grid.half, s), low[: bits - s]))[:bits].as_signed(), f"seen_{axis}")
        for axis, code, (low, _) in zip("xy", corner, box, strict=True)
    )
    x_01, x_02, y_01, y_02 = (stage(value.as_signed(), f"near_{k}") for k, value in enumerate(differences))

    # Stage 5: products, and the steps to the second and to the third centre.
    columns, scanlines = tag[:2], tag[2:4]
    products = [
        stage(value * seen, f"near_product_{k}")
        for k, (value, seen) in enumerate(((y_01, u), (x_01, w), (x_02, w), (y_02, u)))
    ]
    steps = []
    for column, scanline in ((-y_01, x_01), (y_02, -x_02)):
        second = Mux(scanlines.any(), scanline, column)[:bits].as_signed()
        square = columns.any() & scanlines.any()
        steps.append((second, Mux(square, column, second << 1)[: bits + 1].as_signed()))
    steps, tag = passed(steps, "step_5"), stage(tag, "near_tag_5")

    # Stage 6: two edge functions. The steps of the three functions have the sum 0.
    first, _, last = tag[5:]
    edges = [
        stage((value - other - less)[:size].as_signed(), f"edge_6_{k}")
        for k, (value, other, less) in enumerate(((*products[:2], ~first), (*products[2:], last)))
    ]
    third = [(-(a + b))[:width].as_signed() for a, b, width in zip(*steps, (bits, bits + 1), strict=True)]
    steps, tag = passed([*steps, third], "step_6"), stage(tag, "near_tag_6")

    # Stage 7: the third edge function. Bits below a pixel do not change from centre to centre.
    first, middle, last = tag[5:]
    edges.append((total - edges[0] - edges[1] - (~first + ~middle + last))[:size].as_signed())
    edges = [stage(edge[s:].as_signed(), f"edge_7_{k}") for k, edge in enumerate(edges)]
    steps, tag = passed(steps, "step_7"), stage(tag, "near_tag_7")

    # Stage 8: signs at the four places that may be centres of the box.
    signs = [
        [edge[-1], (edge + second)[-1], (edge + third)[-1], (edge + third + second)[-1]]
        for edge, (second, third) in zip(edges, steps, strict=True)
    ]
    inside = Cat(Cat(place).all() | ~Cat(place).any() for place in zip(*signs, strict=True))
    inside, tag = stage(inside, "near_inside"), stage(tag, "near_tag_8")
    columns, scanlines, tested = tag[:2], tag[2:4], tag[4]
    square = columns.any() & scanlines.any()
    third = square | columns[1] | scanlines[1]
    fourth = square | columns.all() | scanlines.all()
    return tested & ~(inside & Cat(1, columns.any() | scanlines.any(), third, fourth)).any()
