"""Parsed Python sources, for tests of the text."""

import ast
from collections.abc import Iterator
from functools import cache

__all__ = ["statements", "tree"]

_BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")


@cache
def tree(source: str) -> ast.Module:
    """A parsed source. All tests of a worker share it."""
    return ast.parse(source)


@cache
def statements(source: str) -> tuple[ast.AST, ...]:
    """The module and its statements at any depth, without their expressions, which are most of the nodes."""

    def walk(node: ast.AST) -> Iterator[ast.AST]:
        yield node
        for block in _BLOCKS:
            for inner in getattr(node, block, ()):
                yield from walk(inner)

    return tuple(walk(tree(source)))
