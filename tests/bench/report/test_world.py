"""The core beside other cores: every row has a reference, and the figures of this core are those of the
store."""

from pathlib import Path

from blysk.bench.report.placed import placed
from blysk.bench.report.world import CORES, OTHERS, claims, own, section
from blysk.bench.tools.families import DEVICE

REFERENCES = Path(__file__).parents[3] / "docs/theory/references.md"


def test_every_core_has_a_reference():
    text = REFERENCES.read_text(encoding="utf-8")
    for key in CORES:
        assert f"### [{key}]" in text
    for printed in OTHERS.values():
        assert printed.keys() == CORES.keys()
        assert all(printed.values())


def test_own_figures_are_those_of_the_store():
    entry = placed(DEVICE)["renormalise", "blinn"]
    found = own("renormalise", "blinn", entry["date"])
    assert f"{entry['luts']:,} LUT" in found["resources"]
    assert f"{entry['fmax_median_mhz']:.0f} MHz" in found["rate"]
    assert own("linear", "lyon2", "")["resources"] == "not placed yet"


def test_cores_stand_beside_each_other():
    """The rows of a quantity follow each other, with ours last. No row has a verdict."""
    tasks = {str(claim.settings): claim.task for claim in claims(quick=True) if claim.task}
    (table,) = section(list(tasks.values()), [task.run() for task in tasks.values()]).parts
    assert table.columns == ["source", "quantity", "printed", "measured"]
    quantities = [row["quantity"] for row in table.records()]
    assert quantities == [quantity for quantity in OTHERS for _ in range(len(CORES) + 3)]
    assert all((row["printed"] is None) == row["source"].startswith("blysk") for row in table.records())
