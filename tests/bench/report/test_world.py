"""The core beside others: every row has a reference, and the figures of this core are those of the store."""

import re
from pathlib import Path

from blysk.bench.report.placed import placed
from blysk.bench.report.world import OTHERS, own, section
from blysk.bench.tools.families import DEVICE

REFERENCES = Path(__file__).parents[3] / "docs/theory/references.md"


def test_every_core_has_a_reference():
    text = REFERENCES.read_text(encoding="utf-8")
    for core in OTHERS:
        key = re.search(r"\[\w+\]$", core.name)[0]
        assert f"### {key}" in text
        assert core.source
        assert all((core.rate, core.device, core.resources, core.per_pixel, core.verified))


def test_own_figures_are_those_of_the_store():
    entry = placed(DEVICE)["renormalise", "blinn"]
    core = own("renormalise", "blinn", (), "")
    assert f"{entry['luts']:,} LUT" in core.resources
    assert f"{entry['fmax_median_mhz']:.0f} MHz" in core.rate
    assert own("linear", "lyon2", (), "").resources == "not placed yet"
    assert len(section([], []).parts[0].rows) == len(OTHERS) + 3
