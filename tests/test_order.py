"""The order of the groups of tests is the same in every run, whatever ran before."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from .conftest import LONGEST, group_of, pytest_collection_modifyitems

IDS = [
    *(f"tests/test_small.py::test_{k}" for k in range(2)),
    *(f"tests/test_large.py::test_{k}" for k in range(9)),
    *(f"tests/test_units.py::test_one[{unit}-{k}]" for k in range(3) for unit in ("gpq", "arccos")),
    f"{LONGEST[-1]}::test_one",
]


def test_groups_are_whole_and_in_one_order():
    expected = [LONGEST[-1], "tests/test_large.py", "tests/test_units.py[arccos", "tests/test_units.py[gpq"]
    for seed in range(4):
        items = [SimpleNamespace(nodeid=name) for name in np.random.default_rng(seed).permutation(IDS)]
        pytest_collection_modifyitems(items)
        groups = [group_of(item.nodeid) for item in items]
        changes = [a for a, b in zip(groups, [None, *groups], strict=False) if a != b]
        assert changes == [*expected, "tests/test_small.py"]


def test_the_longest_groups_exist():
    assert all((Path(__file__).parents[1] / group.partition("[")[0]).exists() for group in LONGEST)
