"""Record of the chord interpolator."""

from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.sim.units.cosines.chord_setup import RECORD as SETUP
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, of_setup, options, status
from blysk.sim.units.record import Record

__all__ = ["RECORD"]

_CHORD = ChordInterpolator()

RECORD = Record(
    name="chord_interpolator",
    title="N·L and half the squared chord from N to H by forward differences",
    source="docs/theory/chord.md#differences",
    variants={
        "chord": measured(_CHORD),
        "chord, interval 1": options(_CHORD, 2, setup_interval=1),
        "chord, interval 26, no highlights": options(
            _CHORD, setup_interval=26, highlights=False, length_bits=9
        ),
        "chord, 1 term, 36 bits": options(ChordInterpolator(1, 36), setup_interval=3),
    },
    expect=expect,
    status=status,
    stimuli=STIMULI | {"corners": of_setup(SETUP)},
    waivers=SETUP.waivers
    | {
        "payload": "2^-28 of a value of which 25 bits are kept; inverted every second cycle.",
        "shifter_0_0": "It is worth 2^-38 at the end of a span of any length, and 25 bits are kept there.",
        "square_shift": "The shifter takes five bits: nothing reads the sixth.",
    },
    still=SETUP.still
    | {
        "twice a number is even": (
            "*_second[0] *_second_difference[0] "
            "top.{spare,payload}[83] top.{spare,payload}[214] chord_setup.spare[83] chord_setup.spare[214]"
        ),
    },
)
