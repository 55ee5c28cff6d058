"""Figures as SVG: small, the same each time, and complete."""

import re

import numpy as np
from matplotlib.figure import Figure

from blysk.bench.svg import svg


def figure_of(*curves, **options):
    figure = Figure(figsize=(2, 1))
    axes = figure.subplots()
    for curve in curves:
        axes.plot(curve, **options)
    return figure


def test_svg_is_small_and_the_same_each_time():
    first, again = (svg(figure_of(np.linspace(0, 1, 50) ** 2)) for _ in range(2))
    assert first == again
    assert "<metadata" not in first
    assert not re.search(r"\d\.\d{2}", first.split("<g>", 1)[1])
    assert len(first) < 10_000


def test_svg_keeps_what_is_written():
    figure = Figure(figsize=(2, 1))
    figure.subplots().set_yticks([0.001, 0.125])
    assert {"0.001", "0.125"} <= set(re.findall(r"<text[^>]*>([^<]*)</text>", svg(figure)))


def test_svg_is_the_same_drawing_with_classes():
    """Every element keeps its style, by itself or by its class."""
    text = svg(figure_of([0, 1], [1, 0], color="#123456", linestyle="--"))
    rules = dict(re.findall(r"^\.(\w+)\{([^}]*)\}$", text, flags=re.MULTILINE))
    used = re.findall(r' class="(\w+)"', text)
    assert set(used) == set(rules)
    assert all(used.count(name) > 1 for name in rules)
    assert sum("#123456" in rules[name] for name in used) + text.count(' style="fill: none; stroke-d') == 2
