"""A cache of compiled models for each test, empty or with one model in it."""

import os
import shutil

import pytest

from .scale import BEATS, scaled, script


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """A compiler that notes in `LOG` what it compiles."""
    text = 'case "$*" in *driver.cc*) echo x >> "$LOG";; esac; exec c++ "$@"'
    return script(tmp_path_factory.mktemp("compiler"), "logged", text)


@pytest.fixture
def builds(tmp_path, logged, monkeypatch):
    """A function that gives the number of models compiled so far."""
    log = tmp_path / "log"
    log.touch()
    monkeypatch.setenv("LOG", str(log))
    monkeypatch.setenv("CXX", logged)
    return lambda: log.read_text().count("x")


@pytest.fixture(scope="module")
def prebuilt(tmp_path_factory, logged):
    """A cache with the model of ``Scale(3)``, as the logged compiler makes it."""
    folder = tmp_path_factory.mktemp("prebuilt") / "cache"
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("BLYSK_CACHE", folder), ("CXX", logged), ("LOG", os.devnull)):
            patch.setenv(name, str(value))
        assert scaled() == (3 * BEATS).tolist()
    return folder


@pytest.fixture
def filled(prebuilt, cache, builds):
    """The cache with that model in it; ``builds`` is 0."""
    shutil.copytree(prebuilt, cache)
    return cache
