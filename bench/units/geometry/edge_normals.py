"""Record of the edge normals."""

from functools import partial

import numpy as np

from blysk.bench.units.geometry.vector_normaliser import deciding_vectors
from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH, SPAN_NORMAL, Pieces
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.edge_normals import EdgeNormalsUnit

__all__ = ["RECORD"]

_FORMATS = {
    "left": SPAN_NORMAL,
    "right": SPAN_NORMAL,
    "depth": SPAN_DEPTH,
    "depth_last": SPAN_DEPTH,
    "depth_step": DEPTH_STEP,
}


def _spans(unit, case):
    words = dict(case.beats)
    words |= {name: Fixed(format, words[name]) for name, format in _FORMATS.items()}
    pieces = Pieces(**words | {"flip": words["flip"].astype(bool)}, triangle=np.zeros(0))
    return unit.model.compute(pieces)


def _case(rng, count, longest):
    ends = [sphere(rng, count) * 2.0 ** rng.uniform(12, 26, (count, 1)) for _ in range(2)]
    beats = dict(zip(("left", "right"), (np.rint(end).astype(np.int64) for end in ends), strict=True))
    beats["left"][::16] = any_codes(rng, SPAN_NORMAL, *beats["left"][::16].shape)
    # Some ends have no direction.
    beats["left"][::11] = beats["right"][::13] = 0
    beats["right"] = np.clip(beats["right"], SPAN_NORMAL.min_code, SPAN_NORMAL.max_code)
    for name in ("depth", "depth_last", "depth_step"):
        beats[name] = any_codes(rng, _FORMATS[name], count)
    beats |= {name: rng.integers(0, 4096, count) for name in ("x", "y")}
    beats["length"] = rng.integers(1, longest + 1, count)
    beats |= {"flip": rng.integers(0, 2, count), "material": rng.integers(0, 1024, count)}
    return Case(beats)


def _short(unit, rng, count):
    """Pieces of 1 to 4 pixels. At some ends the normal has no direction."""
    return _case(rng, count, 4)


def _single(unit, rng, count):
    """Pieces of one pixel, one a cycle."""
    return _case(rng, count, 1)


def _long(unit, rng, count):
    """Pieces of any length."""
    return _case(rng, count, 4095)


def _deciding(unit, rng, count):
    """Pieces of one pixel, with normals whose rounding depends on a single bit."""
    vector = deciding_vectors(rng, count)
    beats = _single(unit, rng, len(vector)).beats
    return Case(beats | {"left": vector, "right": vector, "flip": np.ones(len(vector), dtype=np.int64)})


RECORD = Record(
    name="edge_normals",
    title="Unit normals at both ends of each piece of a span",
    source="[T] figure 4.10",
    variants={
        "": Variant(EdgeNormalsUnit, note="see the vector normaliser"),
        "compact": Variant(partial(EdgeNormalsUnit, compact=True), note="see the vector normaliser"),
    },
    expect=lambda unit, case: _spans(unit, case)[0].beats,
    status=lambda unit, case: {"repaired": _spans(unit, case)[1]},
    stimuli={
        "short": Stimulus(_short, 1000),
        "single": Stimulus(_single, 500, pace=lambda unit: unit.COMPACT_INTERVAL if unit.compact else 1),
        "long": Stimulus(_long, 500),
        "last bits": Stimulus(_short, 50_000, stalled=False),
        "ties": Stimulus(_deciding, 2_000_000, stalled=False),
    },
    axis="",
    waivers={
        "dot_product.datapath.last_product": "The fault adds 1 to a sum of three "
        "squares, or subtracts 1. The last 12 bits of the sum are cut off. Adding 1 changes the other bits "
        "only if the sum is 7 modulo 8. No sum of three squares is 7 modulo 8. Subtracting 1 changes them "
        "only if the sum is 0 modulo 4. Then all components are even, and the bit is 0 already."
    },
    still={"a counter has room for more events than a run has": "count_repaired[12-31]"},
)
