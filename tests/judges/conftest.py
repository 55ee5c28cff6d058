"""The judge that all tests of this folder share."""

import pytest

from .conformant import Conformant


@pytest.fixture(scope="module")
def judge():
    """Mesa's OpenGL on the processor."""
    with pytest.MonkeyPatch.context() as patch:
        judge = Conformant.opened(patch)
        yield judge
        judge.context.release()
