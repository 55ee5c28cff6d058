"""Verilog around a core: a memory of depths, and ports with the names that tools expect."""

from collections.abc import Mapping
from string import Template

from blysk.sim.packages.package import Core

__all__ = ["DEPTH_PORTS", "declared", "depth_memory", "has_depths"]

DEPTH_PORTS = "memory_"
"""Beginning of the names of the ports to the memory of depths."""

_DEPTHS = Template("""\
// $mark.
// A depth for each pixel of a picture of at most WIDTH x HEIGHT pixels, for the ports memory_* of $name.
// The word of a read comes a clock later. A read and a write of one place give the old word.
module ${name}_depths #(
  parameter WIDTH = 640,
  parameter HEIGHT = 480
) (
  input clk,
  input [$x:0] read_place_x,
  input [$y:0] read_place_y,
  input read_enable,
  output reg [23:0] read_data,
  input [$x:0] write_place_x,
  input [$y:0] write_place_y,
  input write_enable,
  input [23:0] write_data
);
  reg [23:0] depths [0:WIDTH * HEIGHT - 1];
  wire [31:0] read_word = read_place_y * WIDTH + read_place_x;
  wire [31:0] write_word = write_place_y * WIDTH + write_place_x;
  always @(posedge clk) begin
    if (read_enable) read_data <= depths[read_word];
    if (write_enable) depths[write_word] <= write_data;
  end
endmodule
""")


def has_depths(core: Core) -> bool:
    """Whether the core has ports to a memory of depths."""
    return any(port.startswith(DEPTH_PORTS) for port in core.ports)


def depth_memory(core: Core, mark: str) -> str:
    """Verilog of a memory of depths, with the size of the picture as parameters."""
    x, y = (core.ports[f"memory_write_place_{axis}"] for axis in "xy")
    return _DEPTHS.substitute(name=core.name, mark=mark, x=-x - 1, y=-y - 1)


def declared(ports: Mapping[str, int]) -> dict[str, str]:
    """Declaration of each port in Verilog, with its direction and width."""
    return {
        port: f"{'output' if bits < 0 else 'input'} {f'[{abs(bits) - 1}:0] ' if abs(bits) > 1 else ''}{port}"
        for port, bits in ports.items()
    }
