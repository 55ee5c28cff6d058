"""Names of mesh files, and the known suffixes."""

import os
from pathlib import Path

from blysk.sim.errors import InputError
from blysk.sim.meshes.refusal import Refused

__all__ = ["SUFFIXES", "check_mesh_file", "check_mesh_path"]

SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf")


def check_mesh_path(path: Path) -> None:
    """Check that a path leads to a file of a known suffix, without opening it.

    Raises
    ------
    Refused
        If there is no such file, or its suffix is not known.
    OSError
        If the system refuses the path.
    """
    if not path.exists():
        raise Refused("there is no such file", "check the path, or use the name teapot")
    if path.is_dir():
        raise Refused("is a folder", "name a file in it")
    if not path.is_file():
        raise Refused("is not a regular file", "name a mesh file")
    if path.suffix.lower() not in SUFFIXES:
        raise Refused(
            f"unknown mesh type {path.suffix!r}" if path.suffix else "the name has no suffix",
            f"use {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}",
        )


def check_mesh_file(source: str | os.PathLike[str]) -> None:
    """Refuse, before long work, a mesh file that is missing or of an unknown type, without opening it.

    The name ``teapot`` is accepted. Names that the system refuses are left to `load_mesh`.

    Raises
    ------
    InputError
        As `load_mesh`.
    """
    if source == "teapot":
        return
    try:
        check_mesh_path(Path(source))
    except Refused as refusal:
        raise InputError(os.fspath(source), refusal.reason, refusal.remedy) from None
    except (OSError, ValueError):
        return
