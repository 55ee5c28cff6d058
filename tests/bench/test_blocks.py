"""The device table: it holds every device, measures what it prints, and errs by no more than is stated."""

import ast
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from bench.blocks import BLOCKS, Sample, rows, table
from golden.adaptive_normaliser import AdaptiveNormaliser
from golden.angular_setup import AngularSetup
from golden.arccos import ARCCOS_TABLES, Arccos, HalfChord
from golden.bisection import Bisection
from golden.bisection_chain import BisectionChain
from golden.highlight_cosine import HighlightCosine
from golden.middle_normal import MIDDLE_NORMAL_FITS, MiddleNormal
from golden.pipeline import METHODS
from golden.power import Power
from golden.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from golden.recurrence import RECURRENCE_FORMS, Recurrence
from golden.renormaliser import Renormaliser
from golden.specular import FURTHER_MODELS, SPECULAR_MODELS, Specular
from hdl.cost import cost_of
from sim.cli import main

PROJECT = Path(__file__).parents[2]
FEW = 4000
KINDS = ("linear", "bisection", "quadratic", "angular", "recurrence", "chord")
# Units without a row: parts that compute nothing, base classes, and parts of a device that has one.
PARTS = {
    "FrameConstantsUnit": "registers behind a write port",
    "PixelAssemblerUnit": "joins two streams",
    "PipelinedUnit": "base class of units",
    "AccumulatorUnit": "base class of difference accumulators",
    "InterpolatorUnit": "base class of methods",
    "NormalInterpolatorUnit": "base class of methods that find normals",
    "LightProductsUnit": "dot products, in every interpolator of normals",
    "ChordAccumulatorUnit": "difference accumulators, in the chord interpolator",
    "SlopeUnit": "in every specular unit",
}
BY_NAME = {(block.device, block.variant): block for block in BLOCKS}
MEASURED = [block for block in BLOCKS if block.measure]


def name(block):
    return f"{block.device} {block.variant}".strip()


def errors(device, variant="", samples=FEW, seed=1):
    return BY_NAME[device, variant].measure(np.random.default_rng(seed), samples).errors


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Text and figures of one run of the command, and the names of the units that it made."""
    path = tmp_path_factory.mktemp("blocks") / "blocks.json"
    with pytest.MonkeyPatch.context() as patch:
        lines, units = [], set()

        def seen(unit):
            units.add(type(unit).__name__)
            return cost_of(unit)

        patch.setattr("bench.blocks.cost_of", seen)
        patch.setattr("click.echo", lambda text, **_: lines.append(text))
        assert main(["blocks", "--samples", "1000", "--seed", "7", "--json", str(path)]) == 0
    return "\n".join(lines), json.loads(path.read_text()), units


def test_every_unit_is_in_the_table(printed):
    units = set()
    for path in (PROJECT / "hdl").glob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and re.fullmatch("[A-Z].*Unit", node.name):
                units.add(node.name)
    shown = printed[2]
    assert not shown & set(PARTS)
    assert units == shown | set(PARTS)


def test_every_variant_is_in_the_table():
    assert len(BY_NAME) == len(BLOCKS)
    variants = {device: [v for d, v in BY_NAME if d == device] for device, _ in BY_NAME}
    documented = [f"{model}, documented" for model in SPECULAR_MODELS]
    assert variants["specular"] == [*SPECULAR_MODELS, *FURTHER_MODELS, "cosquad, interval 2", *documented]
    assert variants["quadratic_evaluator"] == list(QUADRATIC_FORMS)
    assert variants["recurrence"] == [f"{f}{i}" for f in RECURRENCE_FORMS for i in ("", ", interleaved")]
    assert variants["middle_normal"] == [*MIDDLE_NORMAL_FITS, "exact, interval 1"]
    assert sum(len(variants[f"{name}_interpolator"]) for name in KINDS) == len(METHODS)
    assert len(variants["arccos"]) == 2 * len(ARCCOS_TABLES)
    assert len(variants["bisection"]) == 8
    assert {variant.split(", ")[0] for variant in variants["pipeline"]} == set(METHODS)
    assert {variant.split(", ")[1] for variant in variants["pipeline"]} >= set(SPECULAR_MODELS)


def test_json_equals_the_table(printed):
    text, report, _ = printed
    assert report["samples"] == 1000
    assert report["seed"] == 7
    head, *lines = text.splitlines()
    assert len(lines) == len(report["blocks"]) == len(BLOCKS)
    assert max(map(len, text.splitlines())) <= 132
    # Columns end, or start, where the head's do.
    starts = [head.index(word) for word in ("device", "variant", "source", "multipliers")]
    for line, block, row in zip(lines, BLOCKS, report["blocks"], strict=True):
        assert (row["device"], row["variant"]) == (block.device, block.variant)
        assert line[: starts[1]].strip() == row["device"]
        assert line[starts[1] : starts[2]].strip() == row["variant"]
        assert line[starts[2] :].startswith(row["source"])
        # After the source, the unit if there is one, then numbers.
        cells = line[starts[2] + len(row["source"]) : starts[3]].split()
        unit = cells.pop(0) if len(cells) == 8 else "1"
        assert unit == row["error_unit"]
        for cell, key in zip(cells[:3], ("model_error", "arithmetic_error", "total_error"), strict=True):
            if cell == "-":
                assert row[key] is None
            else:
                assert float(cell) == pytest.approx(row[key], rel=0.051, abs=0)
        keys = ("latency", "initiation_interval", "rom_bits", "register_bits")
        assert [int(cell) for cell in cells[3:]] == [row[key] for key in keys]
        found, constant = {}, 0
        for count, width in re.findall(r"(\d+)\*(\S+)", line[starts[3] :]):
            if width == "c":
                constant = int(count)
            else:
                found[width if "x" in width else f"{width}x{width}"] = int(count)
        assert found == row["multipliers"]
        assert constant == row["constant_multipliers"]


def test_what_the_units_state_of_themselves(printed):
    """Times and parts, against the units' own documentation."""
    stated = {
        ("middle_normal", "exact"): (26, 6, {"18x18": 2}, 0),
        ("difference_accumulator", ""): (2, 1, {}, 0),
        ("quadratic_evaluator", "horner"): (17, 2, {"18x18": 3}, 2048 * 18),
        ("bisection", "1, 45"): (21, 4, {"18x18": 2}, 0),
        ("bisection_chain", ""): (17 + 3 * 3 + 8, 17 + 3 * 3 + 8 + 1, {"18x18": 4}, 0),
        ("adaptive_normaliser", "threshold 2^-10"): (69, 1, {"18x18": 3}, 2048 * 17),
        ("highlight_cosine", "interpolated"): (12, 1, {"17x17": 1, "14x14": 1}, 512 * 36),
        ("recurrence", "reinsch"): (3, 4, {"18x18": 2}, 0),
        ("recurrence", "direct"): (3, 3, {"18x18": 2}, 0),
        ("recurrence", "reinsch, interleaved"): (3, 1, {"18x18": 2}, 0),
        ("chord_setup", "interval 4"): (41, 4, {"18x18": 7}, 2048 * 17),
        ("intensity", "1 light, compact"): (11, 6, {"17x17": 1}, 0),
        ("pipeline", "quadratic, cosquad"): (65 + 2, 1, {"18x18": 11, "17x17": 8}, 34816 + 17408),
        ("pipeline", "chord, cosquad"): (60, 1, {"18x18": 7, "17x17": 8}, 34816 + 17408),
    }
    found = {(row["device"], row["variant"]): row for row in printed[1]["blocks"]}
    for key, expected in stated.items():
        row = found[key]
        assert (
            row["latency"],
            row["initiation_interval"],
            row["multipliers"],
            row["rom_bits"],
        ) == expected, key


@pytest.mark.parametrize("block", MEASURED, ids=name)
def test_errors(block):
    """The total is no more than its parts, and the same seed gives the same figures."""
    samples = [block.measure(np.random.default_rng(seed), 1000) for seed in (3, 3, 4)]
    model, arithmetic, total = samples[0].errors
    assert samples[1].errors == samples[0].errors
    assert math.isfinite(total)
    if model is not None:
        assert abs(model - arithmetic) * (1 - 1e-9) - 1e-12 <= total <= model + arithmetic + 1e-12
    np.testing.assert_array_equal(samples[0].found, samples[1].found)
    if not block.exhaustive:
        assert samples[0].found.shape != samples[2].found.shape or np.any(
            samples[0].found != samples[2].found
        )
    else:
        assert np.size(samples[0].found) == 2**17 + 1


def test_row_does_not_depend_on_the_others():
    few = [BY_NAME["gpq", ""], BY_NAME["diffuse", ""]]
    both, alone = list(rows(few, 1000, 5)), list(rows(few[1:], 1000, 5))
    assert both[1].as_dict() == alone[0].as_dict()
    assert table(both).splitlines()[2].split() == table(alone).splitlines()[1].split()


def test_sample_without_a_formula():
    assert Sample(np.array([1.0, 2.0]), np.array([1.5, 2.0])).errors == (None, None, 0.5)


# Bounds that the twins state.


def test_exact_devices():
    assert errors("dot_product") == errors("gpq") == (0, 0, 0)


def test_normals():
    for fit in MIDDLE_NORMAL_FITS:
        assert errors("middle_normal", fit)[2] <= MiddleNormal(fit).error
    for form in QUADRATIC_FORMS:
        assert errors("quadratic_evaluator", form)[2] <= QuadraticEvaluator(form).error
    assert errors("difference_accumulator")[2] <= 2.0**-18
    curve = 2.0**-17 * 0.83 + (2.0**-16 + 2.0**-17 + 2.0**-34) * 0.305 + 2.0**-42 * (4094 + 4094**2 / 2)
    assert errors("difference_setup")[2] <= curve
    assert errors("difference_setup", "documented")[2] <= 2 * curve
    assert errors("renormaliser")[2] <= Renormaliser.ERROR


@pytest.mark.parametrize("variant", [v for d, v in BY_NAME if d == "bisection"])
def test_bisection(variant):
    degree, angle, *documented = variant.split(", ")
    p = Bisection(int(degree), int(angle), bool(documented))
    model, arithmetic, total = errors("bisection", variant)
    steps = (False, True) if angle == "90" else (False,)
    # A component of the sum is at most 2. The domains have a little room for rounding.
    assert model <= 2 * max(p.model_error(step) for step in steps) + 1e-5
    assert arithmetic <= max(p.arithmetic_error(step) for step in steps)
    assert total <= max(p.error(step) for step in steps) + 1e-5


@pytest.mark.parametrize("variant", ["", "documented"])
def test_bisection_chain(variant):
    chain = BisectionChain(Bisection(as_documented=bool(variant)))
    bound = max(chain.error(level, step) for level in range(1, 16) for step in (False, True))
    # Enough spans for some between the two polynomials.
    _, arithmetic, total = errors("bisection_chain", variant, 200_000)
    assert arithmetic < 3e-5
    assert total <= bound


@pytest.mark.parametrize("exponent", [6, 10, 14])
def test_adaptive_normaliser(exponent):
    p = AdaptiveNormaliser(2.0**-exponent)
    model, arithmetic, _ = errors("adaptive_normaliser", f"threshold 2^-{exponent}")
    assert arithmetic <= max(p.error(k, step) for k in range(p.depth + 1) for step in (False, True))
    # Length and direction of a chord at their worst at once; rounding of q.
    assert model <= np.hypot(p.threshold + 2.0**-19, 0.017 * (8.1 * p.threshold + 2.0**-15) ** 1.5) + 1e-5


@pytest.mark.parametrize("table_name", ARCCOS_TABLES)
def test_arccos(table_name):
    model, arithmetic, _ = errors("arccos", f"{table_name}, pipelined")
    assert arithmetic <= Arccos(table_name).arithmetic_error.max()
    # The docstring's table, in its last segment, the worst.
    stated = {"printed": 0.174, "corrected": 0.084, "refitted": 0.019}
    assert model == pytest.approx(stated[table_name], abs=6e-4)


def test_angles():
    assert errors("half_chord")[2] <= HalfChord.RELATIVE_ERROR / 4 + 2.0**-36
    assert errors("highlight_cosine", "interpolated")[2] <= HighlightCosine.ERROR
    assert errors("highlight_cosine", "table alone")[2] <= HighlightCosine.ERROR + np.pi / 1024 / 2
    assert errors("angular_setup", "half chord")[2] <= AngularSetup.error(150.0)
    for interleave, variant in ((1, ""), (4, ", interleaved")):
        bound = Recurrence("reinsch", interleave=interleave).error(4095, np.pi / 2)
        assert errors("recurrence", f"reinsch{variant}")[2] <= bound
    # Unstable in short words.
    assert errors("recurrence", "direct")[2] > 0.05


@pytest.mark.parametrize("model", [*SPECULAR_MODELS, *FURTHER_MODELS])
def test_specular(model):
    _, arithmetic, _ = errors("specular", model)
    assert Specular(model).error / 20 < arithmetic <= Specular(model).error


def test_other_terms():
    assert errors("power", "pipelined")[2] <= Power.ERROR
    # The length of a unit vector, squared; then the rounding.
    model, arithmetic, _ = errors("diffuse")
    assert model <= 2.0**-16
    assert arithmetic <= 2.0**-17
    assert errors("light", "cosquad")[1] <= Specular.ERROR
    # Half a step, and three operands' roundings.
    for style in ("throughput", "compact"):
        assert 0.4 < errors("intensity", f"1 light, {style}")[2] <= 0.5 + 3 * 2.0**-7


@pytest.mark.parametrize("variant", [v for d, v in BY_NAME if d == "pipeline"])
def test_pipeline(variant):
    _, arithmetic, total = errors("pipeline", variant)
    assert 0.4 < arithmetic < 2
    if variant == "chord, blinn":
        # The very model of the reference: only the method and the arithmetic are left.
        assert total < 1


def test_second_lobe_of_the_documented_unit():
    for model in SPECULAR_MODELS:
        assert errors("specular", f"{model}, documented")[1] > 0.9


# Bad input.


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["--samples", "many"],
            "blysk: --samples many: not a whole number; give a whole number from",
        ),
        (["--samples", "999"], "blysk: --samples 999: out of range; give a whole number from 1000 to"),
        (["--seed", "-1"], "blysk: --seed -1: out of range; give a whole number from 0 to"),
        (["--json", "nowhere/x"], "blysk: nowhere/x: cannot be written, there is no folder nowhere; make"),
    ],
)
def test_bad_input_is_one_line(arguments, line, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["blocks", *arguments]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith(line)
    assert errors.count("\n") == 1


def test_help_has_an_example(capsys):
    assert main(["blocks", "--help"]) == 0
    assert re.search(r"Example:\n +blysk blocks ", capsys.readouterr().out)
    assert main(["--help"]) == 0
    assert re.search(r"\n  blocks +\S", capsys.readouterr().out)
