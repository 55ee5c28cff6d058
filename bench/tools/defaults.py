"""Defaults of the tools' options, as the help of their commands shows them."""

__all__ = ["EXPONENT", "SAMPLES", "SEED", "SEEDS", "SIZE"]

SAMPLES = 1_000_000
"""Random operands of a line of `blysk blocks`."""

SEED = 1
"""Seed of the random operands of the units' errors."""

SEEDS = 5
"""Placements of each design of `blysk fpga`."""

EXPONENT = 50
"""Exponent of the sweep of `blysk explore`."""

SIZE = (320, 240)
"""Width and height of the picture of `blysk explore`."""
