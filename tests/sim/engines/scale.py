"""A small component for tests of the compiled engine, for the cache of a test, and for other processes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from amaranth.hdl import Module, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.simulate import simulate
from blysk.sim.installation import install_extra

REMEDY = f"install one, or {install_extra('native')}, or use the engine pysim"


class Scale(Component):
    """``factor x``, through one register."""

    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(36)))

    def __init__(self, factor=3):
        super().__init__()
        self.factor = factor

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload * self.factor)]
        return m


BEATS = np.array([1, -2, 131071, -131072])


def scaled(factor=3, **arguments):
    return simulate(Scale(factor), BEATS, count=4, **arguments).beats.tolist()


def entries(folder, suffix=".model"):
    return sorted(path for path in folder.iterdir() if path.suffix == suffix)


def left_in(*folders):
    """Files in folders, which may not exist."""
    return [path for folder in folders if folder.exists() for path in folder.rglob("*") if path.is_file()]


def script(folder, name, text):
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


PROGRAM = """
import numpy as np
from amaranth.hdl import Assert, Const, Module, Print, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out
from blysk.sim.engines.simulate import simulate

class Triple(Component):
    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(36)))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload * 3)]
        return m
"""


def start(program, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM + program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
        env=os.environ | environment,
    )
