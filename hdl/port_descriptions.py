"""Descriptions of the ports of a shading pipeline, for the table in its Verilog."""

__all__ = ["COUNTER_TEXTS", "PORT_DESCRIPTIONS"]

COUNTER_TEXTS = {
    "empty": "triangles that cover no pixel",
    "zero_area": "triangles without area",
    "culled": "back faces left out",
    "sliver": "triangles at most 1/256 pixel wide",
    "cut": "spans that were cut",
    "repaired": "normals of length 0, replaced by the normal before",
    "spans": "spans shaded",
    "pixels": "pixels shaded",
    "hidden": "shaded pixels behind earlier pixels",
    "dropped": "pixels of spans that the coarse depth test dropped before shading",
    "out_of_range_spans": "spans outside the range of the method",
    "empty_spans": "spans of length 0",
    "overrun": "1 if a span went past the largest column",
    "frames": "completed frames",
    "misfits": "beats with a number that did not fit its field; low bits were taken, or the last material",
}
"""Description of each counter of a core, by its field in ``status``."""

PORT_DESCRIPTIONS = {
    "i_x": "column of the span's first pixel",
    "i_y": "row of the span",
    "i_length": "number of pixels of the span; a span of 0 gives none",
    "i_normal_left": "normal at the first pixel centre, see above",
    "i_normal_right": "normal at the last pixel centre, see above",
    "i_values": "codes of N.L and 1 - N.H of each light at the first pixel, the middle and the last pixel",
    "i_factors": "codes of the factor a of each fading light, at the same three pixels",
    "i_start": "N/W at the first pixel centre, in each light's frame: H along z, L and V in the xz plane",
    "i_step": "step of N/W to the next pixel, times 2^i_exponent",
    "i_exponent": "exponent of i_step, 0 to 15",
    "i_material": "index of the span's material; a larger index counts as the last",
    "i_attributes_start": "attributes at the first pixel centre, see above",
    "i_attributes_step": "step of the attributes to the next pixel, times 2^i_attributes_exponent",
    "i_attributes_exponent": "exponent of i_attributes_step, 0 to 15",
    "i_attributes_base": "whole texel from which u or v counts, -4096 to 4095",
    "i_attributes_range": "a coordinate is base + attribute times 2^range texels of the level, 0 to 11",
    "i_attributes_level": "level of the texture, 0 to 15",
    "o_x": "column of the pixel",
    "o_y": "row of the pixel",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "last pixel of its span",
    "texel_request": "address of a word in a bank of texels",
    "texel_response": "red, green or blue of a bank's texel; answers come in the order of the requests",
    "write_address": "frame constant to write, see above",
    "write_data": "code of the frame constant; accepted when no span is inside",
    **{
        f"status_{name}": f"{COUNTER_TEXTS[name]}; since reset, up to 65535"
        for name in ("out_of_range_spans", "empty_spans")
    },
    "status_overrun": COUNTER_TEXTS["overrun"],
}
"""Ports of the pipeline, for the table in its Verilog."""
