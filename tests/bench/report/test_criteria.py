"""The documents' criteria: frames by the cycle model, bad input through the command line."""

import pytest

from blysk.bench.report.criteria import BAD_INPUT, claims, frame, refused, resources, use
from blysk.bench.report.placed import placed
from blysk.bench.tools.families import DEVICE
from blysk.golden.presets import METHODS


@pytest.mark.parametrize("method", ["quotient", "linear"])
def test_frame(method):
    found = frame(100, (64, 48), method, 50.0)
    assert found["cycles"] >= found["pixels"] + found["latency"]
    assert found["spans"] >= found["uncut_spans"]
    assert found["frames_a_second"] == pytest.approx(50e6 / found["cycles"])
    assert found["frames_a_second"] * found["milliseconds"] == pytest.approx(1000)


def test_bad_input_is_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for command in BAD_INPUT.values():
        found = refused(command)
        assert (found["status"], found["lines"], found["traceback"]) == (2, 1, False)
        assert found["says"].startswith("blysk: ")
    assert list(tmp_path.iterdir()) == []


def test_use_of_resources():
    entry = placed(DEVICE)["quotient", "blinn"]
    assert use(entry["date"])["luts"] == entry["luts"]
    with pytest.raises(ValueError, match="not of 1999"):
        use("1999")


@pytest.mark.long
def test_resources():
    """Each light has its own multipliers."""
    assert resources(1)["multipliers"] == 16
    assert resources(2)["multipliers"] > 16


def test_every_method_has_its_cycles():
    found = [claim for claim in claims(quick=True) if claim.stated == "scaling with triangles and pixels"]
    assert {claim.settings["method"] for claim in found} == set(METHODS)
    assert max(claim.settings["triangles"] for claim in found) == 1_000_000
