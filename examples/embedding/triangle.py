"""Draw a triangle into a memory: the design of triangle.v, in Amaranth and simulated.

python triangle.py triangle.png
"""

import sys

import numpy as np
from amaranth.hdl import Array, Cat, Const, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Out
from amaranth.sim import Simulator
from PIL import Image

import blysk
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.render import Renderer
from blysk.hdl.render import RendererUnit

WIDTH, HEIGHT = 32, 24
# Spans of at most 10 degrees. The header of the core names this limit for exponent 50.
FRAME = FrameSettings.centred(WIDTH, HEIGHT, limit=FrameSettings.limit_of(10)).codes
# Ambient 0.05, diffuse 0.4, specular 0.55, exponent 50, white light along the viewer.
WRITES = {0: 50, 1: 816, 2: 816, 3: 816} | dict(
    enumerate([0, 0, 131071, 0, 0, 131071, 6528, 6528, 6528, 8976, 8976, 8976], 16)
)
# Corners are in 1/256 pixel, counted from the middle of the picture; normals are times 2^23.
TRIANGLE = {
    "x": [-3584, -1024, 3328],
    "y": [-2560, 2816, -512],
    "depth": [1000, 3000, 2000],
    "normal": [[-5033165, 2516582, 6174015], [-838861, -5033165, 6658042], [5872026, 1677722, 5751001]],
    "material": 0,
    "two_sided": 0,
}


class Triangle(wiring.Component):
    """Draws the triangle into ``picture`` after the reset."""

    done: Out(1)

    def __init__(self):
        self.picture = Memory(shape=24, depth=1024, init=[0x1A1C20] * 1024)
        super().__init__()

    def elaborate(self, platform):
        """Connect the core, a table of writes, the triangle and the memory. The core holds the depths."""
        m = Module()
        renderer = Renderer(blysk.design(model="cosquad"))
        m.submodules.core = core = RendererUnit(renderer, size=(WIDTH, HEIGHT))
        m.submodules.picture = self.picture
        n, quiet = Signal(range(32)), Signal(10)
        addresses, data = (Array(map(Const, words)) for words in (WRITES, WRITES.values()))
        m.d.comb += [
            core.constants.eq(core.constants.shape().const(FRAME)),
            core.write.payload.address.eq(addresses[n]),
            core.write.payload.data.eq(data[n]),
            core.write.valid.eq(n < 16),
            core.i.valid.eq(n == 16),
            core.i.payload.material.eq(TRIANGLE["material"]),
            core.i.payload.two_sided.eq(TRIANGLE["two_sided"]),
        ]
        for k in range(3):
            for name in ("x", "y", "depth"):
                m.d.comb += core.i.payload[name][k].as_value().eq(TRIANGLE[name][k])
            for axis in range(3):
                m.d.comb += core.i.payload.normal[k][axis].as_value().eq(TRIANGLE["normal"][k][axis])
        with m.If((core.write.valid & core.write.ready) | (core.i.valid & core.i.ready)):
            m.d.sync += n.eq(n + 1)
        write, pixel = self.picture.write_port(), core.o.payload
        m.d.comb += [
            core.o.ready.eq(1),
            write.en.eq(core.o.valid),
            write.addr.eq(Cat(pixel.x[:5], pixel.y[:5])),
            write.data.eq(Cat(pixel.b, pixel.g, pixel.r)),
            self.done.eq(quiet.all()),
        ]
        with m.If(core.o.valid | (n < 17)):
            m.d.sync += quiet.eq(0)
        with m.Elif(~self.done):
            m.d.sync += quiet.eq(quiet + 1)
        return m


def picture() -> np.ndarray:
    """The picture that Amaranth's simulator draws, uint8 of shape (24, 32, 3)."""
    top, words = Triangle(), []
    simulator = Simulator(top)
    simulator.add_clock(1e-8)

    async def run(context):
        while not context.get(top.done):
            await context.tick()
        words.extend(context.get(top.picture.data[k]) for k in range(WIDTH * HEIGHT))

    simulator.add_testbench(run)
    simulator.run()
    codes = np.array(words).reshape(HEIGHT, WIDTH, 1)
    return (codes >> np.array([16, 8, 0]) & 255).astype(np.uint8)


if __name__ == "__main__":
    Image.fromarray(picture()).resize((WIDTH * 8, HEIGHT * 8), Image.Resampling.NEAREST).save(sys.argv[1])
