"""The house: imports go one way and in no circle, files and functions are short, the wheel is complete."""

import ast
import graphlib
import re
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from .sources import statements, tree

PROJECT = Path(__file__).parents[1]
LAYERS = ("golden", "hdl", "sim", "bench")
# The packages that a layer may import, apart from the standard library and the layers below; None: any.
LIBRARIES = {"golden": {"numpy", "scipy"}, "hdl": {"numpy", "scipy", "amaranth"}, "sim": None, "bench": None}
NOT_IN_THE_WHEEL = {"blysk.bench.quality"}
"""Modules that measure the repository itself, with its tests."""


def name_of(path: Path) -> str:
    """The name by which a file of the project is imported."""
    parts = path.relative_to(PROJECT).with_suffix("").parts
    return ".".join(("blysk", *parts)).removesuffix(".__init__")


FILES = {name_of(path): path for layer in LAYERS for path in sorted((PROJECT / layer).rglob("*.py"))}
FILES = {name: path for name, path in FILES.items() if "templates" not in name}


@cache
def nodes(source: str) -> tuple[ast.AST, ...]:
    """All nodes of a source, at any depth."""
    return tuple(ast.walk(tree(source)))


def imports(source: str, package: str) -> set[str]:
    """Names of all modules that a source imports, at any depth. For `from a import b` these are a and a.b."""
    found = set()
    for node in nodes(source):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package.split(".")[: -node.level + 1 or None]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Call):
            function = (
                node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            )
            if function in ("import_module", "__import__", "run_module") and node.args:
                argument = node.args[0]
                text = argument.value if isinstance(argument, ast.Constant) else ast.unparse(argument)
                found.add(str(text))
    return found


def wrong_imports(layer: str, source: str) -> set[str]:
    """Imports of a source that its layer may not have."""
    below = LAYERS[: LAYERS.index(layer) + 1]
    wrong = set()
    for module in imports(source, f"blysk.{layer}"):
        top, _, rest = module.partition(".")
        if top == "blysk":
            if rest and rest.split(".")[0] not in below:
                wrong.add(module)
        elif top == "tests" or not (
            top in sys.stdlib_module_names or LIBRARIES[layer] is None or top in LIBRARIES[layer]
        ):
            wrong.add(module)
    return wrong


@pytest.mark.parametrize("layer", LAYERS)
def test_imports_go_one_way(layer):
    found = {
        name: wrong_imports(layer, path.read_text(encoding="utf-8"))
        for name, path in FILES.items()
        if name.split(".")[1] == layer
    }
    assert found
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


@pytest.mark.parametrize(
    ("layer", "source"),
    [
        ("golden", "import numpy, amaranth.hdl"),
        ("golden", "def f():\n    from blysk.hdl.core.fixed import SQ"),
        ("golden", "from blysk import hdl"),
        ("golden", "import importlib\nimportlib.import_module('blysk.sim')"),
        ("hdl", "import trimesh"),
        ("hdl", "from blysk.sim.errors import InputError"),
        ("sim", "from blysk.bench import store"),
        ("sim", "import tests.conftest"),
        ("bench", "from tests import conftest"),
    ],
)
def test_a_wrong_import_is_found(layer, source):
    assert wrong_imports(layer, source)


def test_no_import_goes_in_a_circle():
    """Imports inside functions count, too. If an import has to be late, it is in the wrong file."""
    graph = {
        name: (imports(path.read_text(encoding="utf-8"), name) & set(FILES)) - {name}
        for name, path in FILES.items()
    }
    list(graphlib.TopologicalSorter(graph).static_order())


def circle_of_rooms(graph: dict[str, set[str]]) -> list[str]:
    """Rooms of a folder in a circle, if there is a circle. `graph` has the imports of every file.

    A room is a subfolder, or a file beside the subfolders.
    """
    rooms: dict[str, dict[str, set[str]]] = {}
    for name, modules in graph.items():
        for module in modules:
            if FILES[module].name == "__init__.py":
                continue
            own, other = name.split("."), module.split(".")
            depth = next((k for k, pair in enumerate(zip(own, other, strict=False)) if pair[0] != pair[1]), 0)
            if depth > 1:
                folder = rooms.setdefault(".".join(own[:depth]), {})
                folder.setdefault(".".join(own[: depth + 1]), set()).add(".".join(other[: depth + 1]))
    for of_folder in rooms.values():
        try:
            list(graphlib.TopologicalSorter(of_folder).static_order())
        except graphlib.CycleError as error:
            return list(error.args[1])
    return []


def test_no_rooms_import_in_a_circle():
    """In each layer, and in each folder of rooms inside it."""
    graph = {
        name: (imports(path.read_text(encoding="utf-8"), name) & set(FILES)) for name, path in FILES.items()
    }
    assert circle_of_rooms(graph) == []


def test_a_circle_of_rooms_is_found():
    """A circle of rooms is found although no file is in a circle."""
    gate, method = "blysk.golden.lighting.highlight_gate", "blysk.golden.methods.interpolator"
    factor, linear = "blysk.golden.lighting.factor", "blysk.golden.methods.linear_interpolator"
    assert circle_of_rooms({gate: {method}, linear: {method}}) == []
    found = circle_of_rooms({gate: {method}, linear: {factor}})
    assert set(found) == {"blysk.golden.lighting", "blysk.golden.methods"}


STARTERS = {
    "blysk.hdl.emit.processes": "programs",
    "blysk.sim.frames.workers": "workers, which watch their parent",
}
"""Files that may start processes, and the calls that they may use."""


def starts(source: str, package: str) -> set[str]:
    """Calls and imports by which a source starts a process. Its exceptions and constants start none."""
    calls = re.findall(
        r"\bsubprocess\.(?:run|Popen|call|check_call|check_output|getoutput)\b"
        r"|\bos\.(?:system|popen|fork|forkpty|posix_spawn\w*|spawn\w+)\(",
        source,
    )
    if not re.search("subprocess|multiprocessing|ProcessPool", source):
        return set(calls)
    modules = imports(source, package)
    wrong = {"multiprocessing", "concurrent.futures.ProcessPoolExecutor"} & modules
    return {*calls, *wrong, *(module for module in modules if module.startswith("subprocess."))}


def test_processes_end_with_their_parent():
    """All processes are started by the files that end them."""
    found = {name: starts(path.read_text(encoding="utf-8"), name) for name, path in FILES.items()}
    assert {name for name, calls in found.items() if calls} == set(STARTERS)


def test_the_wheel_has_every_package():
    metadata = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = {name for name, path in FILES.items() if path.name == "__init__.py"}
    assert set(metadata["tool"]["setuptools"]["packages"]) == (packages | {"blysk"}) - NOT_IN_THE_WHEEL


# Length.

LINES, FUNCTION_LINES = 500, 100
"""Lines of a file, and of a function without its docstring."""

LONG_FILES = {}
"""Files over the limit, and the reasons."""

LONG_FUNCTIONS: dict[str, str] = {}
"""Functions over the limit, and the reasons."""


def long_functions(source: str) -> dict[str, int]:
    """Lines of functions that are over the limit, without their docstrings."""
    found = {}
    for node in statements(source):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = node.end_lineno - node.lineno + 1
            if ast.get_docstring(node) is not None:
                lines -= node.body[0].end_lineno - node.body[0].lineno + 1
            if lines > FUNCTION_LINES:
                found[node.name] = lines
    return found


def sources() -> dict[str, str]:
    """Every Python file of the project, by its path."""
    return {
        path.relative_to(PROJECT).as_posix(): path.read_text(encoding="utf-8")
        for folder in (*LAYERS, "tests", "blysk")
        for path in sorted((PROJECT / folder).rglob("*.py"))
    }


def test_files_are_short():
    found = {path for path, text in sources().items() if len(text.splitlines()) > LINES}
    assert found - set(LONG_FILES) == set(), f"over {LINES} lines: split them by what they do"
    assert set(LONG_FILES) - found == set(), "short by now: take them off the list"


def test_functions_are_short():
    found = {f"{path}: {name}" for path, text in sources().items() for name in long_functions(text)}
    assert found - set(LONG_FUNCTIONS) == set(), f"over {FUNCTION_LINES} lines: split them"
    assert set(LONG_FUNCTIONS) - found == set(), "short by now: take them off the list"


def test_a_long_function_is_found():
    body = "    x = 1\n"
    assert long_functions("def f():\n" + body * 99) == {}
    assert long_functions("class C:\n  def f(self):\n" + body * 100) == {"f": 101}
    assert long_functions('def f():\n    """One.\n\n    Two."""\n' + body * 99) == {}
