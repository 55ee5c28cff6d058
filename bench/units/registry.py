"""Every record, imported from its file, in the order of `UNITS`.

These components have no record:

- the frame constants, the pixel assembler and the pixel merger. A record needs an input stream ``i`` and an
  output stream ``o``. The records of the pipelines cover these components as parts of the pipelines;
- the accumulator of ``chord-local``. The record of the interpolator covers it as a part of the interpolator;
- the pixel lanes. Their beats depend on the cycles, so they have tests of their own;
- units with other ports: band depths, controls, the draw unit, the loader and its flash reader, and units of
  the display that have two clocks or never wait. They have tests of their own.
"""

from importlib import import_module

from blysk.bench.units.names import UNITS
from blysk.bench.units.record import Record

__all__ = ["RECORDS"]

RECORDS: dict[str, Record] = {name: import_module(module).RECORD for name, module in UNITS.items()}
"""Records by the units' names."""
