"""Imports go one way: golden <- hdl <- sim <- bench."""

import ast
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
STANDARD = set(sys.stdlib_module_names)
LAYERS = ["golden", "hdl", "sim", "bench"]
# What a layer may import apart from the standard library, itself and the layers below; None is anything.
LIBRARIES = {
    "golden": {"numpy", "scipy"},
    "hdl": {"numpy", "scipy", "amaranth"},
    "sim": None,
    "bench": None,
}


def imports(source: str, package: tuple[str, ...]) -> list[tuple[int, str]]:
    """Line and absolute name of every module that a source imports, at any depth and by any means.

    Parameters
    ----------
    source : str
        Text of the module.
    package : tuple of str
        Package that holds it, to which relative imports refer.
    """
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            # `from . import x` at the top of a package names the module x.
            found += [(node.lineno, module)] if module else [(node.lineno, a.name) for a in node.names]
        elif isinstance(node, ast.Call) and node.args:
            function = (
                node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            )
            name = node.args[0]
            if function in ("import_module", "__import__", "run_module"):
                literal = isinstance(name, ast.Constant) and isinstance(name.value, str)
                found.append((node.lineno, name.value if literal else "<not a string>"))
    return found


def wrong_imports(layer: str, source: str, package: tuple[str, ...]) -> list[str]:
    """Imports of a source that its layer may not have, as ``line: module``."""
    own = set(LAYERS[: LAYERS.index(layer) + 1])
    wrong = []
    for line, module in imports(source, package):
        top = module.split(".")[0]
        libraries = LIBRARIES[layer]
        if top in own or top in STANDARD:
            continue
        if (
            top in LAYERS
            or top in ("tests", "<not a string>")
            or (libraries is not None and top not in libraries)
        ):
            wrong.append(f"{line}: {module}")
    return wrong


FILES = [(layer, path) for layer in LAYERS for path in sorted((PROJECT / layer).rglob("*.py"))]


@pytest.mark.parametrize(("layer", "path"), FILES, ids=[str(path.relative_to(PROJECT)) for _, path in FILES])
def test_imports_go_one_way(layer, path):
    package = path.relative_to(PROJECT).parent.parts
    assert wrong_imports(layer, path.read_text(encoding="utf-8"), package) == []


def test_every_layer_is_there():
    assert {layer for layer, _ in FILES} == set(LAYERS)
    assert (PROJECT / "golden" / "geometry.py") in [path for _, path in FILES]


@pytest.mark.parametrize(
    ("layer", "source", "module"),
    [
        ("golden", "import hdl", "hdl"),
        ("golden", "import numpy, amaranth.hdl", "amaranth.hdl"),
        ("golden", "from hdl.fixed import SQ", "hdl.fixed"),
        ("golden", "def f():\n    if 1:\n        from sim import errors", "sim"),
        ("golden", "from ..hdl import fixed", "hdl"),
        ("golden", "from .. import hdl", "hdl"),
        ("golden", "import matplotlib", "matplotlib"),
        ("golden", "import importlib\nimportlib.import_module('hdl.fixed')", "hdl.fixed"),
        ("golden", "__import__('sim')", "sim"),
        ("hdl", "import_module('sim.mesh')", "sim.mesh"),
        ("hdl", "from sim.mesh import load", "sim.mesh"),
        ("hdl", "import trimesh", "trimesh"),
        ("hdl", "try:\n    pass\nexcept Exception:\n    import bench.run as b", "bench.run"),
        ("sim", "class A:\n    from bench import engines", "bench"),
        ("sim", "import importlib as i\ni.import_module('bench.' + x)", "<not a string>"),
        ("sim", "import tests.golden", "tests.golden"),
        ("bench", "from tests import conftest", "tests"),
    ],
)
def test_wrong_import_is_found(layer, source, module):
    [wrong] = wrong_imports(layer, source, (layer,))
    assert wrong.split(": ")[1] == module


@pytest.mark.parametrize(
    ("layer", "source"),
    [
        ("golden", "import numpy as np, scipy.optimize, functools"),
        ("golden", "from . import geometry\nfrom .geometry import Mesh\nfrom golden.geometry import Mesh"),
        ("hdl", "from amaranth.lib import data\nfrom golden import fixed\nfrom hdl.fixed import SQ"),
        ("sim", "import trimesh, golden.x, hdl.y\nimport importlib\nimportlib.import_module('sim.z')"),
        ("bench", "import vtk\nfrom sim import engine"),
        ("golden", "x = 'import hdl'  # import hdl"),
    ],
)
def test_right_import_is_let_through(layer, source):
    assert wrong_imports(layer, source, (layer,)) == []
