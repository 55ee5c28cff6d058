# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
"""arccos and half-chord units: RTL against their twins, clock by clock."""

import numpy as np
import pytest

from blysk.golden.cosines.arccos import Arccos, HalfChord
from blysk.golden.number.fixed import Fixed
from blysk.hdl.cosines.arccos import ArccosUnit, HalfChordUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate

FORMAT = Arccos.OPERAND_FORMAT


def assert_equals_twin(table, form, x):
    angle, outside = Arccos(table).compute(Fixed(FORMAT, x))
    run = simulate(ArccosUnit(Arccos(table), form), x, count=len(x), engine="auto")
    np.testing.assert_array_equal(run.beats["angle"], angle.codes)
    np.testing.assert_array_equal(run.beats["outside"], outside)


@pytest.mark.parametrize("form", ["pipelined", "sequential"])
@pytest.mark.parametrize("table", ["as_published", "corrected"])
def test_documented_table_equals_twin(table, form):
    # 13 has no factor in common with a binary word, so every segment meets every low bit.
    assert_equals_twin(table, form, np.arange(FORMAT.min_code, FORMAT.max_code + 1, 13))


@pytest.mark.parametrize(
    ("table", "form"),
    [
        ("refitted", "pipelined"),
        pytest.param("refitted", "sequential", marks=pytest.mark.long),
        *(
            pytest.param(table, form, marks=pytest.mark.long)
            for table in ("as_published", "corrected")
            for form in ("pipelined", "sequential")
        ),
    ],
)
def test_arccos_equals_twin_for_every_input(table, form):
    assert_equals_twin(table, form, np.arange(FORMAT.min_code, FORMAT.max_code + 1))


@pytest.mark.parametrize("form", ["pipelined", "sequential"])
def test_arccos_clocks_and_stalls(verify, form):
    rng = np.random.default_rng(3)
    one = 1 << FORMAT.fraction_bits
    bounds = Arccos().bounds
    edges = np.r_[0, 1, bounds - 1, bounds, bounds + 1, one - 1, one, one + 1, FORMAT.max_code]
    x = np.r_[edges, -edges, FORMAT.min_code, rng.integers(-one, one + 1, 800)]
    angle, outside = Arccos().compute(Fixed(FORMAT, x))
    verify(ArccosUnit(form=form), x, {"angle": angle.codes, "outside": outside})


@pytest.mark.parametrize("interval", [None, 1, 2, 3, 4, 5])
def test_half_chord_equals_twin(verify, interval):
    rng = np.random.default_rng(4)
    format = HalfChord.OPERAND_FORMAT
    half = 1 << 35
    powers = 1 << np.arange(36)
    edges = np.r_[0, powers, powers - 1, format.max_code, half + 1, half - 2, half + (1 << 17)]
    size = np.trunc(2.0 ** rng.uniform(0, 36, 2000)).astype(np.int64)
    chord = np.r_[edges, size, rng.integers(0, half, 500)]
    supplement = rng.random(len(chord)) < 0.3
    expected = HalfChord().compute(Fixed(format, chord), supplement)
    verify(
        HalfChordUnit(initiation_interval=interval),
        {"chord_squared": chord, "supplement": supplement},
        expected.codes,
    )


def test_every_bit_of_a_half_chord_counts():
    """The last bits of the table, of the products and of the sums are rounded off: each decides rarely."""
    rng = np.random.default_rng(5)
    size = np.trunc(2.0 ** rng.uniform(0, 35, 50_000)).astype(np.int64)
    chord = np.r_[size, rng.integers(0, 1 << 35, 150_000)]
    supplement = rng.random(len(chord)) < 0.3
    expected = HalfChord().compute(Fixed(HalfChord.OPERAND_FORMAT, chord), supplement)
    beats = {"chord_squared": chord, "supplement": supplement}
    run = simulate(HalfChordUnit(), beats, count=len(chord), engine="auto")
    np.testing.assert_array_equal(run.beats, expected.codes)


def test_half_chord_times_as_stated():
    units = [HalfChordUnit(initiation_interval=interval) for interval in range(1, 7)]
    assert [unit.latency for unit in units] == [35, 38, 37, 36, 36, 40]
    assert [cost_of(unit).multiplier_count for unit in units] == [6, 3, 2, 2, 2, 1]
    with pytest.raises(ValueError, match=r"^initiation_interval must be 1 to 6, not 7$"):
        HalfChordUnit(initiation_interval=7)


def test_unknown_form():
    with pytest.raises(ValueError, match="form must be 'pipelined' or 'sequential', not 'fast'"):
        ArccosUnit(form="fast")
