"""Commands of this layer, as the package registers them under ``blysk.commands``."""

from blysk.sim.cli.lazy_command import LazyCommand

__all__ = ["absorb", "bench", "blocks", "board", "explore", "fpga", "pages", "send", "web"]

absorb = LazyCommand("Move registers into multipliers of a netlist for ECP5.", "blysk.bench.cli.absorb")
bench = LazyCommand("Measure error against run time, and write the report.", "blysk.bench.cli.bench")
blocks = LazyCommand("Print the table of the units: errors, times, parts.", "blysk.bench.cli.blocks")
board = LazyCommand(
    "Show a turning mesh on a monitor: make a board's bitstream, or simulate it.", "blysk.bench.cli.board"
)
explore = LazyCommand("Sweep the designs, and list the cheapest under an error.", "blysk.bench.cli.explore")
fpga = LazyCommand("Place and route for an FPGA: parts and clock rate.", "blysk.bench.cli.fpga")
pages = LazyCommand("Write a page of each unit, with drawings.", "blysk.bench.cli.pages")
send = LazyCommand("Send another mesh to a board that runs.", "blysk.bench.cli.send")
web = LazyCommand("Write a site in which a browser simulates the pipeline.", "blysk.bench.cli.web")
