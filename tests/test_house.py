"""The house: imports go one way and in no circle, and every package is in the wheel."""

import ast
import graphlib
import sys
import tomllib
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
LAYERS = ("golden", "hdl", "sim", "bench")
# What a layer may import apart from the standard library and the layers below; None is anything.
LIBRARIES = {"golden": {"numpy", "scipy"}, "hdl": {"numpy", "scipy", "amaranth"}, "sim": None, "bench": None}
NOT_IN_THE_WHEEL = {"blysk.bench.quality"}
"""What measures the repository itself, with its tests."""


def name_of(path: Path) -> str:
    """Name by which a file of the project is imported."""
    parts = path.relative_to(PROJECT).with_suffix("").parts
    return ".".join(("blysk", *parts)).removesuffix(".__init__")


FILES = {name_of(path): path for layer in LAYERS for path in sorted((PROJECT / layer).rglob("*.py"))}
FILES = {name: path for name, path in FILES.items() if "templates" not in name}


def imports(source: str, package: str) -> set[str]:
    """Names of all modules that a source imports, at any depth; of `from a import b` a and a.b."""
    found = set()
    for node in ast.walk(ast.parse(source)):
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
    """Inside functions too: what must be imported late is in the wrong file."""
    graph = {
        name: (imports(path.read_text(encoding="utf-8"), name) & set(FILES)) - {name}
        for name, path in FILES.items()
    }
    list(graphlib.TopologicalSorter(graph).static_order())


def test_the_wheel_has_every_package():
    metadata = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = {name for name, path in FILES.items() if path.name == "__init__.py"}
    assert set(metadata["tool"]["setuptools"]["packages"]) == (packages | {"blysk"}) - NOT_IN_THE_WHEEL
