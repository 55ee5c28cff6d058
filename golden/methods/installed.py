"""Methods of other installed packages, which announce their modules by entry points."""

from collections.abc import Iterable
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["GROUP", "MethodError", "installed_methods", "load_methods"]

GROUP = "blysk.methods"
"""Group of the entry points."""


class MethodError(Exception):
    """A method of another package cannot be added."""


def installed_methods() -> "list[EntryPoint]":
    """Entry points of the methods of other installed packages, by name.

    Each entry point names a module with

    - ``METHODS``, a dictionary of `Interpolator` objects with a line about each;
    - the component of the method: a subclass of `InterpolatorUnit` whose ``model=`` names its class;
    - ``RECORD``, if tables and tests of units are to find the component.
    """
    # The call reads the metadata of every package.
    from importlib.metadata import entry_points

    return sorted(entry_points(group=GROUP), key=lambda entry: entry.name)


def load_methods(known: Iterable[str]) -> list[ModuleType]:
    """Modules of the methods of other installed packages.

    Parameters
    ----------
    known : iterable of str
        Names of the methods that exist already.

    Raises
    ------
    MethodError
        If a module cannot be imported, lacks ``METHODS``, or has a method with the name of another method.
    """
    names, found = set(known), []
    for entry in installed_methods():
        package = entry.dist.name if entry.dist else entry.value
        try:
            module = entry.load()
            own = [method.name for method in module.METHODS]
        except Exception as error:
            said = " ".join(str(error).split())
            reason = f"its module {entry.value} fails with {type(error).__name__}: {said}"
            raise MethodError(f"package {package}: {reason}; mend or uninstall it") from error
        if twice := sorted(names.intersection(own)):
            reason = f"there is a method {twice[0]} already"
            raise MethodError(f"package {package}: {reason}; rename its method, or uninstall it")
        names.update(own)
        found.append(module)
    return found
