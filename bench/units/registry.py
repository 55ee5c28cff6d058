"""Every record, imported from its file: in the order of `UNITS`.

Components without a record: the frame constants, the
pixel assembler and the pixel merger, whose ports are not a stream ``i`` to a stream ``o``, and the
accumulator of ``chord-local``. The records of the pipelines and of this interpolator, of which they are
parts, cover them. Beats of the pixel lanes depend on the cycles: they have tests of their own. So have
units with other ports: band depths, controls, the draw unit, and the units of the display that have two
clocks or never wait.
"""

from importlib import import_module

from blysk.bench.units.names import UNITS
from blysk.bench.units.record import Record

__all__ = ["RECORDS"]

RECORDS: dict[str, Record] = {name: import_module(module).RECORD for name, module in UNITS.items()}
"""Records by the units' names."""
