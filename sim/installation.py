"""Commands that install a missing package for the running Python."""

import importlib.metadata
import json
import shlex
import sys
from pathlib import Path

__all__ = ["install_extra", "install_package"]


def install_package(requirement: str) -> str:
    """The shell command that installs a package of PyPI where this package is installed.

    Parameters
    ----------
    requirement : str
        Name of the package, or another requirement of pip.
    """
    return shlex.join([sys.executable, "-m", "pip", "install", requirement])


def install_extra(extra: str) -> str:
    """The shell command that installs an extra of this package, such as ``fpga``.

    In a clone the command names the clone's folder, because no package index has the clone. If pip installed
    the package from a folder, a file or a repository, the command names this origin. Pip notes the origin in
    ``direct_url.json`` (PEP 610).

    Parameters
    ----------
    extra : str
        One of the extras in pyproject.toml.
    """
    root = Path(__file__).resolve().parents[1]
    if (root / "pyproject.toml").is_file():
        return shlex.join([sys.executable, "-m", "pip", "install", "-e", f"{root}[{extra}]"])
    origin = _origin()
    return install_package(f"blysk[{extra}] @ {origin}" if origin else f"blysk[{extra}]")


def _origin() -> str:
    """URL from which pip took this package. Empty for a package index."""
    try:
        text = importlib.metadata.distribution("blysk").read_text("direct_url.json")
    except importlib.metadata.PackageNotFoundError:
        text = None
    found = json.loads(text or "{}")
    url, repository = found.get("url", ""), found.get("vcs_info")
    return f"{repository['vcs']}+{url}@{repository['commit_id']}" if repository else url
