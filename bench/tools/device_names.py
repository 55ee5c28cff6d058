"""Names of the FPGAs to which Yosys maps without placement; see `blysk.bench.tools.devices`."""

__all__ = ["DEVICE_NAMES"]

DEVICE_NAMES = {
    "xc7": "7 series",
    "gowin": "Gowin GW2A",
    "nexus": "Lattice Nexus",
    "cyclonev": "Cyclone V",
    "ice40": "iCE40 UP",
    "gatemate": "GateMate",
}
"""Kinds of FPGAs in tables, by their names on the command line."""
