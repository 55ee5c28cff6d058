"""Descriptions of the ports of a shading pipeline, for the table in its Verilog."""

from blysk.golden.albedo.attribute_spans import AttributeSpans

__all__ = ["COUNTER_TEXTS", "LANE_DESCRIPTIONS", "PORT_DESCRIPTIONS", "SPAN_COUNTER_BITS", "TEXTURE_TEXTS"]

SPAN_COUNTER_BITS = 16
"""Bits of a pipeline's counters of spans, which stop at their largest value."""

COUNTER_TEXTS = {
    "empty": "triangles that cover no pixel",
    "zero_area": "triangles without area",
    "culled": "culled back faces",
    "sliver": "triangles at most 1/256 pixel wide",
    "cut": "spans cut into pieces",
    "repaired": "normals of length 0, each replaced by the normal before it",
    "spans": "spans shaded",
    "pixels": "pixels shaded",
    "hidden": "shaded pixels hidden by earlier pixels",
    "dropped": "pixels not shaded, because the coarse depth test dropped their spans",
    "out_of_range_spans": "spans outside the range of the method",
    "empty_spans": "spans of length 0",
    "overrun": "1 if a span went past the largest column",
    "frames": "completed frames",
    "misfits": "beats with a number that did not fit its field: its low bits or the last material were taken",
}
"""Description of each counter of a core, by its field in ``status``."""

_BASE, _LEVEL = AttributeSpans.BASE_FORMAT, AttributeSpans.LEVEL_FORMAT

TEXTURE_TEXTS = {
    "base": f"base of u or v: whole texel from which it is counted, {_BASE.min_code} to {_BASE.max_code}",
    "range": f"range of u or v, 0 to {AttributeSpans.LARGEST_RANGE}: the coordinate is "
    "base + attribute 2^range texels",
    "level": f"level of the texture, 0 to {_LEVEL.max_code}",
}
"""Descriptions of the words that place texture coordinates, of a span or a triangle."""

PORT_DESCRIPTIONS = {
    "i_x": "column of the span's first pixel",
    "i_y": "row of the span",
    "i_length": "number of pixels of the span; a span of length 0 gives no pixel",
    "i_normal_left": "normal at the first pixel centre",
    "i_normal_right": "normal at the last pixel centre",
    "i_values": "codes of N.L and 1 - N.H of each light at three places: first pixel, middle, last pixel",
    "i_factors": "codes of the factor of each fading light, at the same three places",
    "i_start": "N/W at the first pixel centre, in each light's frame: H along z, L and V in the xz plane",
    "i_step": "step of N/W to the next pixel, times 2^i_exponent",
    "i_exponent": "exponent of i_step, 0 to 15",
    "i_line": "exact product of i_start and sin a, cos a of each light, as above",
    "i_line_step": "exact product of i_step and sin a, cos a of each light, as above",
    "i_material": "index of the span's material; an index past the last material counts as the last",
    "i_attributes_start": "attributes at the first pixel centre, in the order above",
    "i_attributes_step": "step of the attributes to the next pixel, times 2^i_attributes_exponent",
    "i_attributes_exponent": "exponent of i_attributes_step, 0 to 15",
    **{f"i_attributes_{name}": text for name, text in TEXTURE_TEXTS.items()},
    "o_x": "column of the pixel",
    "o_y": "row of the pixel",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "1 at the last pixel of a span",
    "texel_request": "address of a word in a bank of texels",
    "texel_response": "red, green or blue of a texel in a bank; responses have the order of the requests",
    "write_address": "address of the frame constant to write, from the list above",
    "write_data": "code of the frame constant; the core accepts it when no span is inside",
    **{
        f"status_{name}": f"{COUNTER_TEXTS[name]}; since reset, up to {(1 << SPAN_COUNTER_BITS) - 1}"
        for name in ("out_of_range_spans", "empty_spans")
    },
    "status_overrun": COUNTER_TEXTS["overrun"],
}
"""Ports of the pipeline, for the table in its Verilog."""

LANE_DESCRIPTIONS = {
    "o_x": "column of the pixel of lane 0; lane k has the pixel at column o_x + k",
    "o_y": "row of the pixels",
    "o_present": "a bit for each lane with a pixel; lane 0 always has a pixel",
    "o_colors": "red, green, blue of the pixel of a lane; 0 without a pixel",
    "o_last": "1 at the last beat of a span",
}
"""Pixel ports of a pipeline with several lanes, in place of the pixel ports of `PORT_DESCRIPTIONS`."""
