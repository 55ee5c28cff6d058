"""Mapped and routed designs in the cache, so that an interrupted build goes on where it was."""

import contextlib
import hashlib
import inspect
import os
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

from blysk.sim.engines.cache import cache_folder

__all__ = ["KeptBuild", "text_of"]


def text_of(*steps: Callable) -> str:
    """Text of the files that define these functions, for the inputs of a `KeptBuild`."""
    return "".join(Path(inspect.getfile(step)).read_text(encoding="utf-8") for step in steps)


class KeptBuild:
    """Files of a build in the cache. Each file is there as a whole, or is not there.

    Parameters
    ----------
    inputs : iterable of str or bytes
        Everything on which the files depend: netlist, constraints, options, versions of the tools.

    Attributes
    ----------
    MOST : int
        Number of builds that stay. A new build replaces the oldest. A board's build takes about 50 MB.
    """

    MOST = 12

    def __init__(self, inputs: Iterable[str | bytes]):
        digest = hashlib.sha256()
        for part in inputs:
            digest.update(hashlib.sha256(part if isinstance(part, bytes) else part.encode()).digest())
        builds = cache_folder() / "builds"
        self._folder = builds / digest.hexdigest()
        # A build that is not kept takes longer when it is run again, and nothing else.
        with contextlib.suppress(OSError):
            self._make()
            self._folder.touch()
            oldest_last = sorted(builds.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
            for old in oldest_last[self.MOST :]:
                shutil.rmtree(old, ignore_errors=True)

    def _make(self) -> None:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def take(self, folder: Path, *names: str) -> bool:
        """Copy kept files into a folder. ``False`` if one of them is not kept. Nothing is copied then."""
        if not all((self._folder / name).is_file() for name in names):
            return False
        try:
            for name in names:
                shutil.copyfile(self._folder / name, folder / name)
        except OSError:
            return False
        return True

    def keep(self, folder: Path, *names: str) -> None:
        """Keep files of a folder, at once. A file that cannot be written is not kept."""
        for name in names:
            temporary = self._folder / f".{os.getpid()}-{name}"
            with contextlib.suppress(OSError):
                # Newer builds may have replaced the folder since.
                self._make()
                try:
                    shutil.copyfile(folder / name, temporary)
                    os.replace(temporary, self._folder / name)
                finally:
                    temporary.unlink(missing_ok=True)
