"""Commands of this layer, as the package registers them under ``blysk.commands``."""

from blysk.sim.cli.lazy_command import LazyCommand

__all__ = ["bench", "blocks", "board", "explore", "fpga", "pages", "web"]

bench = LazyCommand("Report: error against run time, all measured.", "blysk.bench.cli.bench")
blocks = LazyCommand("Table of the units: errors, times, parts.", "blysk.bench.cli.blocks")
board = LazyCommand(
    "A turning mesh on a monitor: bitstream for a board, or its lanes simulated.", "blysk.bench.cli.board"
)
explore = LazyCommand(
    "Sweep the design space: the cheapest designs under an error.", "blysk.bench.cli.explore"
)
fpga = LazyCommand("Place and route for an FPGA: parts, clock rate.", "blysk.bench.cli.fpga")
pages = LazyCommand("Pages of the units, with drawings.", "blysk.bench.cli.pages")
web = LazyCommand("A site in which a browser simulates the pipeline.", "blysk.bench.cli.web")
