"""The report's table of devices: the lines of ``blysk blocks``."""

from blysk.bench.report.devices import QUICK_SAMPLES, measure, section, tasks
from blysk.bench.tools.blocks import BLOCKS, row_of, sample_of


def test_a_line_is_that_of_the_device_table():
    (block,) = (block for block in BLOCKS if (block.device, block.variant) == ("specular", "cosquad"))
    line = measure("specular", "cosquad", 2000)
    expected = row_of(block, sample_of(block, 2000)).as_dict()
    assert {**line, "samples": expected["samples"]} == expected


def test_every_device_is_measured():
    found = [(task.settings["device"], task.settings["variant"]) for task in tasks(False)]
    assert found == [(block.device, block.variant) for block in BLOCKS]
    assert len(set(found)) == len(found)
    quick = tasks(True)
    assert {task.settings["samples"] for task in quick} == {QUICK_SAMPLES}
    assert ("middle_normal", "as_published") in [
        (task.settings["device"], task.settings["variant"]) for task in quick
    ]


def test_section():
    chosen = [
        task
        for task in tasks(True)
        if (task.settings["device"], task.settings["variant"])
        in [("dot_product", ""), ("middle_normal", "exact"), ("middle_normal", "as_published")]
    ]
    results = [measure(task.settings["device"], task.settings["variant"], 1000) for task in chosen]
    found = section(chosen, results)
    (table,) = found.parts
    lines = table.records()
    assert [line["as printed"] for line in lines] == [False, False, True]
    assert [line["total error"] for line in lines] == [result["total_error"] for result in results]
    # What the documents print is worse by far.
    assert lines[0]["total error"] == 0
    assert lines[2]["total error"] > 100 * lines[1]["total error"]
    assert lines[0]["multipliers"] == "3 of 18x18"
    assert any("3 of the" in paragraph for paragraph in found.text)
