"""The test that cocotb runs: a program's way through a frame, by the bus master of the SoC."""

import json
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge

PATIENCE = 200_000


async def access(dut, address, word=None):
    """Read or write a word."""
    dut.host_adr.value = address >> 2
    dut.host_we.value = int(word is not None)
    dut.host_dat_w.value = word or 0
    dut.host_cyc.value = dut.host_stb.value = 1
    for _ in range(1000):
        await RisingEdge(dut.sys_clk)
        if dut.host_ack.value == 1 or dut.host_err.value == 1:
            break
    else:
        raise AssertionError(f"no answer at {address:#x}")
    assert dut.host_err.value == 0, f"refused at {address:#x}"
    found = dut.host_dat_r.value
    dut.host_cyc.value = dut.host_stb.value = 0
    await RisingEdge(dut.sys_clk)
    return None if word is not None else int(found)


@cocotb.test()
async def frame(dut):
    """Write registers, start the reader, wait for the interrupt, and compare every word of the picture."""
    soc, case = (json.loads(Path(name).read_text()) for name in ("soc.json", "case.json"))
    csr, registers, memory = soc["csr"], soc["registers"], soc["memory"]
    dut.host_cyc.value = dut.host_stb.value = 0
    dut.host_sel.value = 15
    dut.sys_clk.value = 0
    Clock(dut.sys_clk, 10, unit="ns").start(start_high=False)
    for _ in range(10):
        await RisingEdge(dut.sys_clk)
    assert await access(dut, registers) == int.from_bytes(b"BLSK", "big")
    for address, word in case["writes"]:
        await access(dut, registers + 4 * address, word)
    base = memory + case["frame"]
    for name, word in (
        ("core_frame_base", base),
        ("core_frame_stride", 4 * case["width"]),
        ("core_reader_length", case["length"]),
        ("core_ev_enable", 1),
    ):
        await access(dut, csr[name], word)
    # A CSR of 64 bits has its upper word first.
    await access(dut, csr["core_reader_base"] + 4, memory)
    assert await access(dut, csr["core_ev_pending"]) == 0
    await access(dut, csr["core_reader_enable"], 1)
    for _ in range(PATIENCE):
        if await access(dut, csr["core_ev_pending"]):
            break
    else:
        raise AssertionError("no interrupt")
    assert await access(dut, csr["core_reader_done"]) == 1
    while await access(dut, registers + case["state"]):
        pass
    assert await access(dut, registers + case["misfits"]) == 0
    picture = [await access(dut, base + 4 * k) for k in range(len(case["picture"]))]
    wrong = [(k, a, b) for k, (a, b) in enumerate(zip(picture, case["picture"], strict=True)) if a != b]
    assert not wrong, f"{len(wrong)} pixels differ, the first: {wrong[0]}"
    dut._log.info("%d pixels as expected, %d of them drawn", len(picture), case["drawn"])
