# amaranth: UnusedElaboratable=no
"""Proof about the texture sampler with a memory outside: its requests keep the rules of a stream."""

import pytest

from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.hdl.albedo.texture_sampler import TextureSamplerUnit

from .prover import Harness
from .rules import stays

pytestmark = pytest.mark.prove


def test_requests_that_wait_stay(prove):
    """By induction: a valid request stays until it is accepted, whatever the answers do."""
    model = TextureSampler(TexelMemory(4, external=True), bilinear=False)
    unit = TextureSamplerUnit(model, waiting=4)
    h = Harness(unit)
    stays(h, unit.request)
    prove(h)
