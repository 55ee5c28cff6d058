# amaranth: UnusedElaboratable=no
"""arccos unit: what it refuses; `tests.test_units` holds it against its model."""

import pytest

from blysk.hdl.cosines.arccos import ArccosUnit


def test_unknown_form():
    with pytest.raises(ValueError, match=r"^form must be 'pipelined' or 'sequential', not 'fast'$"):
        ArccosUnit(form="fast")
