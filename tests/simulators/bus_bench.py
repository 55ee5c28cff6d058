"""The test that cocotb runs in a simulator: frames through a core on a bus, with public models of the buses.

``case.npz`` beside the simulation has the input and the expected output. Both sides of every stream and
channel pause at random.
"""

import itertools
import random
from pathlib import Path

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge, Timer, with_timeout
from cocotbext.axi import (
    AxiLiteBus,
    AxiLiteMaster,
    AxiResp,
    AxiStreamBus,
    AxiStreamFrame,
    AxiStreamMonitor,
    AxiStreamSink,
    AxiStreamSource,
)
from cocotbext.wishbone.driver import WBOp, WishboneMaster

OKAY = "okay"
REFUSED = "refused"


def pauses(share):
    return (random.random() < share for _ in itertools.count())


class Axi:
    """Registers by AXI4-Lite."""

    def __init__(self, dut, case):
        self.master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axil"), dut.clk, dut.rst)
        both = self.master.write_if, self.master.read_if
        channels = [
            getattr(end, f"{name}_channel", None) for end in both for name in ("aw", "w", "b", "ar", "r")
        ]
        for channel in filter(None, channels):
            channel.set_pause_generator(pauses(0.4))

    async def write(self, address, word):
        answer = await self.master.write(int(address), int(word).to_bytes(4, "little"))
        return {AxiResp.OKAY: OKAY, AxiResp.SLVERR: REFUSED}[answer.resp]

    async def write_byte(self, address):
        answer = await self.master.write(int(address), b"\1")
        return {AxiResp.OKAY: OKAY, AxiResp.SLVERR: REFUSED}[answer.resp]

    async def read(self, address):
        answer = await self.master.read(int(address), 4)
        return {AxiResp.OKAY: OKAY, AxiResp.SLVERR: REFUSED}[answer.resp], int.from_bytes(
            answer.data, "little"
        )


class Classic(WishboneMaster):
    """An initiator that keeps its request until it is answered."""

    _optional_signals = ()


class Wishbone:
    """Registers by Wishbone, pipelined or classic."""

    def __init__(self, dut, case):
        names = dict.fromkeys(("cyc", "stb", "we", "adr", "ack", "sel", "err")) | {
            "datwr": "dat_w",
            "datrd": "dat_r",
        }
        kind = Classic
        if case["pipelined"]:
            kind, names["stall"] = WishboneMaster, None
        signals = {name: port or name for name, port in names.items()}
        self.master = kind(dut, "wb", dut.clk, timeout=1000, signals_dict=signals)

    async def _do(self, **operation):
        (answer,) = await self.master.send_cycle([WBOp(idle=random.randrange(3), acktimeout=50, **operation)])
        return {1: OKAY, 2: REFUSED}[answer.ack], int(answer.datrd) if answer.datrd.is_resolvable else None

    async def write(self, address, word):
        return (await self._do(adr=int(address) >> 2, dat=int(word)))[0]

    async def write_byte(self, address):
        return (await self._do(adr=int(address) >> 2, dat=1, sel=1))[0]

    async def read(self, address):
        return await self._do(adr=int(address) >> 2)


async def refusals(bus, case):
    """Refused accesses are answered as refused, and the registers tell why."""
    assert await bus.read(0) == (OKAY, int.from_bytes(b"BLSK", "big"))
    errors, refused, scratch = (int(case[name]) for name in ("errors", "refused", "scratch"))
    assert await bus.read(errors) == (OKAY, 0)
    assert (await bus.read(0x03C))[0] == REFUSED
    assert await bus.read(refused) == (OKAY, 0x03C)
    assert await bus.write(0, 1) == REFUSED
    assert (await bus.read(scratch))[0] == REFUSED
    assert await bus.write(scratch, 1 << 31) == REFUSED
    assert await bus.write_byte(scratch) == REFUSED
    assert await bus.read(refused) == (OKAY, scratch)
    assert await bus.read(errors) == (OKAY, 0b11111)
    assert await bus.write(errors, 0b10101) == OKAY
    assert await bus.read(errors) == (OKAY, 0b01010)
    # As drivers do: all ones, most of them for bits that do not exist.
    assert await bus.write(errors, 0xFFFFFFFF) == OKAY
    assert await bus.read(errors) == (OKAY, 0)


@cocotb.test()
async def frames(dut):
    """Registers, then frames with pauses on all sides, then the counters."""
    case = np.load(Path("case.npz"))
    random.seed(int(case["seed"]))
    dut.clk.value, dut.rst.value = 0, 1
    await Timer(1, "ns")
    # There is one cycle of reset. Before it nothing is defined, and the models of the buses do not look.
    cocotb.start_soon(Clock(dut.clk, 10, "ns").start())
    await RisingEdge(dut.clk)
    dut.rst.value = 0
    await Timer(1, "ns")
    source = AxiStreamSource(AxiStreamBus.from_prefix(dut, "s_axis"), dut.clk, dut.rst)
    sink = AxiStreamSink(AxiStreamBus.from_prefix(dut, "m_axis"), dut.clk, dut.rst)
    AxiStreamMonitor(AxiStreamBus.from_prefix(dut, "m_axis"), dut.clk, dut.rst)
    bus = (Axi if case["bus"] == "axi" else Wishbone)(dut, case)
    await RisingEdge(dut.clk)
    source.set_pause_generator(pauses(0.3))
    sink.set_pause_generator(pauses(0.3))

    if "scratch" in case:
        await refusals(bus, case)
    for address, word in case["writes"]:
        assert await bus.write(address, word) == OKAY
    await with_timeout(draw(dut, case, source, sink, bus), 1, "ms")
    for address, word in case["counters"]:
        assert await bus.read(address) == (OKAY, int(word)), hex(address)


async def draw(dut, case, source, sink, bus):
    """Draw all frames, and check the output, its packets and marks. Constants are locked meanwhile."""
    state, size = int(case["state"]), case["given"].shape[1]
    ends = np.flatnonzero(case["given_last"]) + 1
    for part in np.split(case["given"], ends[:-1]):
        await source.send(AxiStreamFrame(part.tobytes()))
    while (await bus.read(state))[1] == 0:
        pass
    if "scratch" in case:
        assert await bus.write(case["scratch"], 1) == REFUSED
    found, user, last = [], [], []
    size = case["data"].shape[1]
    while len(found) < len(case["data"]):
        packet = await sink.recv(compact=False)
        assert len(packet.tdata) % size == 0
        assert all(packet.tkeep)
        data = np.frombuffer(bytes(packet.tdata), np.uint8).reshape(-1, size)
        found += list(data)
        user += packet.tuser[::size]
        last += [0] * (len(data) - 1) + [1]
    np.testing.assert_array_equal(found, case["data"])
    np.testing.assert_array_equal(last, case["last"])
    np.testing.assert_array_equal(user, case["first"] + 2 * case["end"])
    while (await bus.read(state))[1]:
        pass
    assert sink.empty()
