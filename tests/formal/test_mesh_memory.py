"""Vertices of the mesh memory that wait stay, also while words are written."""

import pytest

from blysk.bench.units.video.meshes import any_memory
from blysk.hdl.video.mesh_memory import MeshMemoryUnit

from .prover import Harness
from .rules import stays

pytestmark = pytest.mark.prove


def test_vertices_that_wait_stay(prove):
    """By induction, for a memory of four vertices with any words, before and after writes.

    The memory itself keeps the word that waits. A memory without a write port may give any word in every
    cycle of a proof, so this memory has a write port.
    """
    harness = Harness(MeshMemoryUnit(any_memory(4, 2), loads=True))
    stays(harness, harness.unit.o)
    prove(harness)
