"""A cache of compiled models of each test's own."""

import pytest


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder that is not there yet, and the compilers of the machine."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("BLYSK_CACHE", str(folder))
    monkeypatch.delenv("CXX", raising=False)
    return folder
