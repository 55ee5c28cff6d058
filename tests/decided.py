"""Statements that were decided before, known by digests: proofs, and runs of units in structures that change
seldom."""

import hashlib
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Decided", "digest_of"]


class Decided:
    """Digests of statements that were found true before.

    A digest covers all of the statement, also the netlist of the unit. If a unit or a statement about it
    changes, the digest changes, and the statement is decided again.

    Parameters
    ----------
    digests : iterable of str
        The known digests.

    Attributes
    ----------
    used : set
        Digests that were asked for and known, or were added.
    """

    FILE = Path(__file__).with_name("decided.txt")
    """Digests that `make decided` has written, one in each line."""

    def __init__(self, digests: Iterable[str]):
        self._known = set(digests)
        self.used: set[str] = set()

    @classmethod
    def read(cls) -> "Decided":
        """The digests in `FILE`."""
        return cls(cls.FILE.read_text(encoding="ascii").split())

    def knows(self, digest: str) -> bool:
        """Whether a statement was found true before."""
        if digest in self._known:
            self.used.add(digest)
        return digest in self._known

    def add(self, digest: str) -> None:
        """Note that a statement is true."""
        self.used.add(digest)

    def keep(self) -> None:
        """Append the used digests to the file that the variable ``DECIDED`` names, if it names a file."""
        if path := os.environ.get("DECIDED"):
            with open(path, "a", encoding="ascii") as file:
                file.writelines(f"{digest}\n" for digest in sorted(self.used))


def digest_of(*parts: Any) -> str:
    """Digest of texts, numbers, arrays, and of mappings and sequences of these."""
    digest = hashlib.sha256()
    for text in _texts(parts):
        digest.update(b"%d:" % len(text))
        digest.update(text)
    return digest.hexdigest()[:32]


def _texts(part: Any) -> Iterable[bytes]:
    if isinstance(part, Mapping):
        yield b"%d" % len(part)
        for name in sorted(part):
            yield name.encode()
            yield from _texts(part[name])
    elif isinstance(part, np.ndarray) and part.dtype.names:
        yield from _texts({name: part[name] for name in part.dtype.names})
    elif isinstance(part, np.ndarray) and not part.dtype.hasobject:
        yield f"{part.dtype.str} {part.shape}".encode()
        yield np.ascontiguousarray(part).tobytes()
    elif isinstance(part, (np.ndarray, tuple, list)):
        yield b"%d" % len(part)
        for each in part:
            yield from _texts(each)
    elif part is None or isinstance(part, (str, bool, int, float, np.generic)):
        yield f"{type(part).__name__} {part}".encode()
    else:
        raise TypeError(f"{part!r} has no digest")
