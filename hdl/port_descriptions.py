"""What each port of a shading pipeline carries, for the table in its Verilog."""

__all__ = ["PORT_DESCRIPTIONS"]

PORT_DESCRIPTIONS = {
    "i_x": "first pixel of the span, column",
    "i_y": "its row",
    "i_length": "pixels of the span; 0 gives none",
    "i_normal_left": "normal at the first pixel centre, see above",
    "i_normal_right": "normal at the last pixel centre, see above",
    "i_values": "codes of N.L and 1 - N.H of each light at the first pixel, the middle and the last pixel",
    "i_factors": "codes of a, each light's that fades, at the same three pixels",
    "i_start": "N/W at the first pixel centre, in each light's frame: H along z, L and V in the xz plane",
    "i_step": "its step to the next pixel, times 2^exponent",
    "i_exponent": "0 to 15",
    "i_material": "index of the span's material; past the last it counts as the last",
    "o_x": "column of the pixel",
    "o_y": "row",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "last pixel of its span",
    "write_address": "frame constant to write, see above",
    "write_data": "its code; accepted when no span is inside",
    "status_out_of_range_spans": "spans since reset beyond what the method serves, up to 65535",
    "status_empty_spans": "spans of length 0 since reset, up to 65535",
    "status_overrun": "a span went past the largest column",
}
"""Ports of the pipeline, for the table in its Verilog."""
