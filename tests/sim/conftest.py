"""A cache of compiled models and a folder of temporary files for each test."""

import tempfile

import pytest

from blysk.sim.engines.cache import private_folder


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder that does not exist yet, and the compilers of the machine."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("BLYSK_CACHE", str(folder))
    monkeypatch.delenv("CXX", raising=False)
    return folder


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    private_folder.cache_clear()
    yield folder
    private_folder.cache_clear()
