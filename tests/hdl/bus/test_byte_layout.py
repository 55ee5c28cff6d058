"""Layouts of bytes against the C ABI of ctypes and of the C compiler; packing against hardware."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Module, Shape, Signal, Value
from amaranth.lib import data
from amaranth.sim import Simulator

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.bus.byte_layout import ByteLayout, Field
from blysk.golden.presets import preset
from blysk.hdl.bus.byte_layout import bytes_of, fields_of, layout_of, misfits
from blysk.hdl.geometry.edge_normals import true_spans_shape
from blysk.hdl.geometry.triangles import triangle_shape
from blysk.hdl.pipeline import span_shape
from blysk.hdl.pixel_assembler import pixel_shape

SHAPES = {
    "triangle": triangle_shape(),
    "span": span_shape(preset("linear", "cosquad")),
    "values": span_shape(preset("chord-local", "cosquad", lights=2)),
    "albedo": span_shape(replace(preset("quotient"), albedo=Albedo(texture=TextureSampler()))),
    "true span": true_spans_shape(),
    "pixel": pixel_shape(),
}


def structure(layout):
    """The structure of ctypes, which follows the C compiler of the platform."""
    fields = []
    for field in layout.fields:
        kind = getattr(ctypes, f"c_{'' if field.signed else 'u'}int{8 * field.size}")
        for size in reversed(field.shape):
            kind = kind * size
        fields.append((field.name, kind))
    return type("Structure", (ctypes.LittleEndianStructure,), {"_fields_": fields})


@pytest.mark.parametrize("name", SHAPES)
def test_layout_is_that_of_c(name):
    layout = layout_of(SHAPES[name])
    expected = structure(layout)
    assert layout.size == ctypes.sizeof(expected)
    assert layout.offsets == tuple(getattr(expected, field.name).offset for field in layout.fields)


def codes(rng, layout, count):
    found = {}
    for field in layout.fields:
        low, high = (
            (-(1 << field.width - 1), (1 << field.width - 1)) if field.signed else (0, 1 << field.width)
        )
        found[field.name] = rng.integers(low, high, (count, *field.shape))
        found[field.name][0], found[field.name][1] = low, high - 1
    return found


@pytest.mark.parametrize("name", SHAPES)
def test_hardware_packs_as_the_model(name):
    """Payloads are packed to bytes and back. If a number is a bit too wide, the payload is a misfit."""
    shape = SHAPES[name]
    layout, rng = layout_of(shape), np.random.default_rng(2026)
    expected = codes(rng, layout, 6)
    packed = layout.pack(expected)
    for field, array in layout.unpack(packed).items():
        np.testing.assert_array_equal(array, expected[field])
    m, word = Module(), Signal(8 * layout.size)
    payload, back, wrong = Signal(Shape.cast(shape).width), Signal(8 * layout.size), Signal()
    m.d.comb += [
        payload.eq(fields_of(shape, word)),
        back.eq(bytes_of(shape, payload)),
        wrong.eq(misfits(layout, word)),
    ]
    simulator = Simulator(m)

    async def run(context):
        for row in packed:
            given = int.from_bytes(row.tobytes(), "little")
            context.set(word, given)
            assert context.get(Value.cast(back)) == given
            assert context.get(wrong) == 0
            for field, offset in zip(layout.fields, layout.offsets, strict=True):
                for k in range(field.count):
                    if field.width < 8 * field.size:
                        flipped = given ^ 1 << 8 * (offset + k * field.size) + field.width
                        context.set(word, flipped)
                        assert context.get(wrong) == 1, field

    simulator.add_testbench(run)
    simulator.run()


def test_an_index_past_the_last_is_a_misfit():
    """The index counts as the last. A bit outside the field does not make it smaller."""
    layout = layout_of(data.StructLayout({"a": 3, "index": 10}), below={"index": 3})
    given = np.array([(0, 0), (7, 2), (7, 3), (0, 1023), (0, 1024), (0, 1 << 15 | 3)])
    words = np.zeros(len(given), layout.dtype)
    words["a"], words["index"] = given.T
    packed = words.view(np.uint8).reshape(len(given), layout.size)
    fits = [True, True, False, False, False, False]
    assert layout.fits(packed).tolist() == fits
    assert layout.unpack(packed)["index"].tolist() == [0, 2, 2, 2, 0, 2]
    m, word, wrong = Module(), Signal(8 * layout.size), Signal()
    m.d.comb += wrong.eq(misfits(layout, word))
    simulator = Simulator(m)

    async def run(context):
        for row, fit in zip(packed, fits, strict=True):
            context.set(word, int.from_bytes(row.tobytes(), "little"))
            assert context.get(wrong) != fit

    simulator.add_testbench(run)
    simulator.run()
    with pytest.raises(ValueError, match="field index holds 0 to 2"):
        layout.pack({"a": np.array([0]), "index": np.array([3])})


def test_bad_fields_and_codes():
    with pytest.raises(ValueError, match="1 to 64 bits, not 65"):
        Field("wide", 65)
    with pytest.raises(ValueError, match="field x holds -8 to 7"):
        ByteLayout((Field("x", 4, True),)).pack({"x": np.array([8])})
