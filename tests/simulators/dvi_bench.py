"""Run by cocotb: cocotbext-dvi decodes the lanes and compares every pixel with a picture."""

import os

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles
from cocotbext.dvi import DVIBus, DVISink

PIXEL = 40_000
"""Period of the pixel clock, ps."""


@cocotb.test(timeout_time=500, timeout_unit="us")
async def two_frames(dut):
    """Two frames, after the first vertical sync pulse."""
    width, height = map(int, os.environ["DVI_SIZE"].split("x"))
    clocks = (dut.serial_clk, PIXEL // 5), (dut.pixel_clk, PIXEL), (dut.clk, int(os.environ["DVI_DRAW"]))
    for clock, period in clocks:
        Clock(clock, period, "ps").start()
    # This is in the middle of the first pulse, because the decoder takes the end of a pulse for the beginning
    # of a frame.
    await ClockCycles(dut.pixel_clk, int(os.environ["DVI_START"]))
    sink = DVISink(dut, DVIBus.from_prefix(dut, "tmds"), image_file=os.environ["DVI_IMAGE"])
    await sink.frame_finished(2)
    frames = sink.rgb_out.frames
    assert [len(frame.data) for frame in frames] == [width * height] * len(frames)
    assert abs(sink.clk_freq - 1e6 / PIXEL) < 1e-6
