"""Record of the angular interpolator."""

from blysk.golden.methods.angular_interpolator import PUBLISHED, AngularInterpolator
from blysk.sim.units.cosines.angular_setup import RECORD as SETUP
from blysk.sim.units.cosines.highlight_cosine import RECORD as COSINE
from blysk.sim.units.methods.interpolator import STIMULI, expect, measured, options, status
from blysk.sim.units.methods.light_products import CONSTANT
from blysk.sim.units.record import Record

__all__ = ["RECORD"]

_ANGULAR = AngularInterpolator()

_OF_WORDS = ("second bit", "three squares", "are less than 4, those shifted", "a root is 1", "two such sums")
"""Reasons of the setup for bits that toggle here, or are among more of them."""

_STILL = {
    reason: bits for reason, bits in SETUP.still.items() if not any(words in reason for words in _OF_WORDS)
}


def _variants():
    yield "angular", measured(_ANGULAR)
    yield "angular, interval 1", options(_ANGULAR, 2, setup_interval=1)
    yield "angular, interval 6, no highlights", options(_ANGULAR, setup_interval=6, highlights=False)
    for method in PUBLISHED:
        yield method.name, options(method, as_published=True)


RECORD = Record(
    name="angular_interpolator",
    title="Cosines of angles in equal steps on the great circle",
    source="docs/theory/interpolation.md#angular-method; [T] 3.1, 3.2",
    variants=dict(_variants()),
    expect=expect,
    status=status,
    stimuli=STIMULI,
    waivers={
        "cordic_*": "The controlling bit, of 1 and more, is 0: the axes are at most 0.71 and the root of 2.",
        "minor_operand": "While the output is stalled, the register holds a word that has been read.",
        "phase": "Inverted every second cycle, and read in those cycles only.",
    },
    still=_STILL
    | COSINE.still
    | {
        "half an angle of 36 bits has 37": "phase[0-2] {top,setup_*_0}.spare[36-38] top.{spare,payload}[0-2]",
        "an angle is half a turn at most, and a step is less": (
            "psi_rounded[18] step[39] setup_*_0.spare[115] top.{spare,payload}[79]"
        ),
        "parts of the distance of a unit vector, shifted right by CORDIC, are less than 4": (
            "gain_1_sum*[31-33] gain_6_sum[26-33] gain_13_sum*[19-33] gain_16_sum[16-33] gain_23_sum*[9-33] "
            "cos_beta_rounded[26-29]"
        ),
        "a root is less than 1, and so are the distance and the factor of a cosine": (
            "root_sum[21] root_rounded[17-18] z_rounded[18] wave.factor_6[17]"
        ),
        CONSTANT: "setup_*.datapath.operands[108-161]",
        "L and H are unit vectors: sum and distance are less than 4, the product less than 2": (
            "squares[36-38] chord_exact[36-40] cross[35-38]"
        ),
    },
)
