"""The store of place and route: names, merging, and the data that the report takes from it."""

import json
import re
from pathlib import Path

from click.testing import CliRunner

from blysk.bench.report import placed as module
from blysk.bench.report.placed import merged, placed
from blysk.bench.tools.device_names import DEVICE_NAMES
from blysk.bench.tools.devices import PARTS
from blysk.bench.tools.families import DEVICE
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS, PUBLISHED
from blysk.golden.rivals.registry import RIVALS
from blysk.sim.api.placed import STORE, design_of, read_store

COLORED = ", srgb", ", srgb, compact"
"""Ends of the names of pipelines with an albedo."""

GUIDE = Path(__file__).parents[3] / "docs/guide/fpga.md"


def test_table_of_the_guide_is_the_store():
    """Every row of a pipeline has the figures of the store: parts, and a clock rate for each seed."""
    store = {entry["design"]: entry for entry in read_store() if entry["device"] == DEVICE}
    rows = re.findall(
        r"^\| `([\w-]+)`, `(\w+)`(, 1 - N·H)?(, interval \d)?(, 2 lanes)? \| "
        r"([\d,]+) \| ([\d,]+) \| (\d+) \| (\d+) \| ([\d, ]+\d)",
        GUIDE.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    for method, model, other, interval, lanes, *parts, rates in rows:
        options = f"{', one_minus_cosine' * bool(other)}{interval}{', 2 pixel lanes' * bool(lanes)}"
        entry = store[f"pipeline {method}, {model}, 1 light{options}"]
        shown = [int(part.replace(",", "")) for part in parts]
        assert shown == [entry[name] for name in ("luts", "flip_flops", "multipliers", "block_rams")], entry
        assert [int(rate) for rate in rates.split(", ")] == sorted(map(round, entry["fmax_mhz"])), entry
    plain = [name for name in store if name.startswith("pipeline ") and not name.endswith(COLORED)]
    assert len(rows) == len(plain)


def test_table_of_the_readme_is_the_store():
    """Parts of its designs, in the order of its columns. `renormalise` has its default interval."""
    text = (GUIDE.parents[2] / "README.md").read_text(encoding="utf-8")
    heads, cells = (
        next(line for line in text.splitlines() if line.startswith(first)).split("|")[2:-1]
        for first in ("| | `quotient`, `blinn` |", "| LUT, flip-flops, placed on an ECP5-25F |")
    )
    store = {entry["design"]: entry for entry in read_store() if entry["device"] == DEVICE}
    for head, cell in zip(heads, cells, strict=True):
        method, model = re.findall(r"`(\w+)`", head)
        entry = store[f"pipeline {method}, {model}, 1 light{', one_minus_cosine' * ('N·H' in head)}"]
        assert cell.strip() == f"{entry['luts']:,}, {entry['flip_flops']:,}", head


def test_table_of_rivals_is_the_store():
    """Every placed row has the rates of the store and their number. Designs of no placement are not in it."""
    page = GUIDE.with_name("rivals.md").read_text(encoding="utf-8").partition("## Placed")[2]
    rows = re.findall(
        r"^\| `([\w-]+)`([^|]*) \| `(\w+)` \| (?:RTL|a model) \| ([^|]+) \| (\d) \|$", page, re.MULTILINE
    )
    store = {entry["design"]: entry["fmax_mhz"] for entry in read_store() if entry["device"] == DEVICE}
    placed_rows = 0
    for method, form, model, rates, seeds in rows:
        method = "angular" if "angular" in form else method
        interval = form if form in (", interval 4", ", interval 2", ", interval 1") else ""
        name = f"pipeline {method}, {model}, 1 light{', one_minus_cosine' * ('N·H' in form)}{interval}"
        if rates in ("not placed", "does not fit", "none"):
            assert int(seeds) == 0
            assert name not in store
            continue
        placed_rows += 1
        assert [int(rate) for rate in rates.split(", ")] == sorted(map(round, store[name])), name
        assert int(seeds) == len(store[name])
    assert placed_rows == 15
    assert {method for method, *_ in rows} >= {name.partition(",")[0] for name in RIVALS} - {
        "bishop-weimer-six"
    }


def test_table_of_colours_is_the_store():
    """Every placed row of a pipeline with an albedo has the figures of the store."""
    store = {entry["design"]: entry for entry in read_store() if entry["design"].endswith(COLORED)}
    rows = re.findall(
        r"^\| `(\w+)`(, compact)? \| [\w-]+ \| ([\d,]+) \| ([\d,]+) \| (\d+) \| (\d+) \| ([\d, ]+\d) \|",
        GUIDE.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    for albedo, style, *parts, rates in rows:
        entry = store[f"pipeline quotient, blinn, 1 light, {albedo}, srgb{style}"]
        shown = [int(part.replace(",", "")) for part in parts]
        assert shown == [entry[name] for name in ("luts", "flip_flops", "multipliers", "block_rams")], entry
        assert [int(rate) for rate in rates.split(", ")] == sorted(map(round, entry["fmax_mhz"])), entry
    assert len(rows) == len(store)


def test_table_of_other_fpgas_is_the_store():
    """Every row of a design without placement has the parts of the store, and every entry has a row."""
    clocked = ", memories synchronous"
    store = {
        (entry["device"], entry["design"].endswith(clocked)): entry
        for entry in read_store()
        if not entry["fmax_mhz"]
    }
    rows = re.findall(
        r"^\| ([\w ]+) \| (within a cycle|at a clock edge) \|((?: [\d,]+ \|){7})$",
        GUIDE.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert {entry["device"] for entry in store.values()} == set(DEVICE_NAMES.values())
    assert {(device, memories == "at a clock edge") for device, memories, _ in rows} == set(store)
    for device, memories, cells in rows:
        shown = [int(cell.replace(",", "")) for cell in cells.split("|")[:-1]]
        entry = store[device, memories == "at a clock edge"]
        assert shown == [entry[part] for part in PARTS.values()], entry


def measured(name, *rates):
    parts = dict.fromkeys(("luts", "flip_flops", "multipliers", "block_rams", "distributed_rams"), 7)
    seeds = [{"seed": k, "fmax": rate} for k, rate in enumerate(rates, 1)]
    return {
        "device": DEVICE,
        "tools": {"pyosys": "1"},
        "designs": [{"design": name, **parts, "seeds": seeds}],
    }


def test_names():
    assert design_of("pipeline quotient, blinn, 1 light") == ("quotient", "blinn")
    best = "pipeline quadratic, blinn, 1 light, one_minus_cosine"
    assert design_of(best) == ("quadratic", "blinn", "one_minus_cosine")
    for other in (
        "specular",
        "pipeline quotient, blinn, 2 lights",
        "pipeline quotient, blinn, 1 light, compact",
        "pipeline renormalise, exp, 1 light, interval 4",
    ):
        assert design_of(other) is None


def test_names_have_the_interval_of_the_command():
    """Else a placement would stand for the design with the usual interval."""
    of_command = [re.findall(r"--setup-interval (\d+)", entry["command"]) for entry in read_store()]
    assert [re.findall(r", interval (\d+)", entry["design"]) for entry in read_store()] == of_command


def test_committed_store():
    found = placed(DEVICE)
    assert ("quotient", "blinn") in found
    for method, model, *_ in found:
        assert method in METHODS | PUBLISHED
        assert model in {*MODELS, *LOBES, *MIRROR_LOBES}
    assert read_store() == sorted(read_store(), key=lambda entry: (entry["device"], entry["design"]))
    assert STORE.is_file()


def test_newer_figures_replace_older_ones(tmp_path):
    name = "pipeline linear, blinn, 1 light, one_minus_cosine"
    first = merged([], measured(name, 90.0, 110.0), "2026-01-01", "by hand")
    again = merged(first, measured(name, 100.0), "2026-02-01", "blysk fpga")
    assert [entry["fmax_mhz"] for entry in again] == [[100.0]]
    file, store = tmp_path / "a.json", tmp_path / "store.json"
    file.write_text(json.dumps(measured(name, 90.0, 110.0)))
    result = CliRunner().invoke(module._merge, [str(file), "--date", "2026-01-01", "--store", str(store)])
    assert result.exit_code == 0, result.output
    (entry,) = placed(DEVICE, store).values()
    assert (entry["fmax_median_mhz"], entry["date"], entry["luts"]) == (100.0, "2026-01-01", 7)


def test_other_files_are_refused(tmp_path):
    file = tmp_path / "a.json"
    file.write_text("{}")
    found = CliRunner().invoke(module._merge, [str(file), "--store", str(tmp_path / "store.json")])
    assert "has no figures of place and route" in str(found.exception)
    assert not (tmp_path / "store.json").exists()
