"""Digests: different things have different digests."""

import numpy as np
import pytest

from .decided import Decided, digest_of

WORD = np.array([(1, 2)], dtype=[("a", "<i8"), ("b", "<i8")])
PARTS = [
    *("", "a", None, True, 1, 1.0, (), ("a",), ("a", "b"), ("ab",), (("a",), "b"), {"a": 1}, {"b": 1}),
    *(np.arange(3), np.arange(4), np.arange(3, dtype=np.int32), np.arange(4).reshape(2, 2), WORD),
    *(np.array([2**70, 1], dtype=object), {"a": {"b": 1}}, {"a": 1, "b": 1}),
]


def test_different_parts_have_different_digests():
    assert len({digest_of(part) for part in PARTS}) == len(PARTS)
    assert digest_of({"b": 1, "a": WORD}) == digest_of({"a": WORD.copy(), "b": 1})
    assert digest_of("a", "b") != digest_of("ab")


def test_what_has_no_digest_is_refused():
    with pytest.raises(TypeError, match="has no digest"):
        digest_of(object())


def test_what_was_used_is_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("DECIDED", str(tmp_path / "kept"))
    decided = Decided(["old", "gone"])
    assert decided.knows("old")
    assert not decided.knows("new")
    decided.add("new")
    decided.keep()
    assert (tmp_path / "kept").read_text() == "new\nold\n"
