"""Structures of units as parameters of tests."""

import pytest

__all__ = ["mostly_long"]


def mostly_long(cases, *quick):
    """Arguments of a parametrised test. All except the quick cases belong to the long run."""
    return [
        case
        if case in quick
        else pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long)
        for case in cases
    ]
