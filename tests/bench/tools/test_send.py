"""``blysk send``: bytes by a port and into a file; bad input and missing tools in one line."""

import os
import sys
import termios
import threading
import tty
from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.tools import send as sending
from blysk.bench.tools.board import planned
from blysk.bench.tools.boards import board_named
from blysk.bench.tools.send import send
from blysk.sim.cli.main import main
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

GIVEN = ("send", "teapot", "--board", "ulx3s-25f")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["send", "teapot"], "--board: missing; give one of ulx3s-25f, ulx3s-85f, icepi-zero"),
        ([*GIVEN], "--port, --output: nothing to send to; give --port PORT, or --output FILE"),
        (
            [*GIVEN, "--port", "x", "-o", "y"],
            "--port, --output: one of both is enough; give --port PORT, or --output FILE",
        ),
    ],
)
def test_bad_input_is_one_line(arguments, message, refused):
    refused(*arguments, line=message)


def test_bytes_in_a_file(tmp_path, capsys):
    """The file loads a smaller mesh into the memories of a teapot, and a loader of both sources takes it."""
    given = {"triangles": 100, "exponent": 300}
    path = tmp_path / "a.packets"
    options = ("--triangles", "100", "--exponent", "300", "--loader", "both", "-o", str(path))
    assert main([*GIVEN, *options]) == 0
    gpu, *_ = planned(board_named("ulx3s-25f"), "teapot", given, "rgb888", 52.5, None, "both")
    told = f"written     {path}, {path.stat().st_size:,} bytes\n"
    assert capsys.readouterr().out.endswith(told)
    decoder = gpu.loader.decoder
    writes, counts = decoder.compute(np.frombuffer(path.read_bytes(), dtype=np.uint8))
    assert counts["packets"] == sum(counts.values())
    empty = replace(decoder, memories=tuple(replace(of, words=()) for of in decoder.memories))
    for found, sent in zip(empty.written(writes), gpu.drawing.memories, strict=True):
        assert found.words == (*sent.words, *[0] * (sent.depth - len(sent.words)))


@pytest.mark.ci
@pytest.mark.long
def test_a_mesh_of_another_design(tmp_path, refused):
    """A mesh that is larger than the bitstream's, and a clock that is too slow for the line."""
    triangle = tmp_path / "a.obj"
    triangle.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    line = "mesh teapot: does not fit the bitstream: "
    refused(*GIVEN, "--made-for", str(triangle), "-o", "x", line=line)
    line = "--clock: a loader at 3 Mbaud needs 30 MHz, not 21; give a faster --clock, or --loader flash"
    refused(*GIVEN, "--clock", "21", "-o", "x", line=line)


def test_missing_library_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    assert main([*GIVEN, "--port", "/dev/ttyUSB0"]) == 2
    assert capsys.readouterr().err == f"blysk: --port: pyserial is not installed; {install_extra('loader')}\n"


@pytest.fixture
def terminal():
    """Both ends of a serial line without hardware: a file, and the name of a port."""
    pytest.importorskip("serial", reason="the Python package pyserial is not installed")
    there, here = os.openpty()
    tty.setraw(there)
    yield there, os.ttyname(here)
    for end in (there, here):
        os.close(end)


def test_bytes_by_a_port(terminal):
    """All bytes arrive in their order, and the port has the loader's rate."""
    there, port = terminal
    data, found = bytes(range(256)) * 20, bytearray()

    def take():
        while len(found) < len(data):
            found.extend(os.read(there, 4096))

    reader = threading.Thread(target=take, daemon=True)
    reader.start()
    send(port, data)
    reader.join(10)
    assert bytes(found) == data
    assert termios.tcgetattr(there)[5] == termios.B3000000


def test_a_port_that_takes_nothing(terminal, monkeypatch):
    """A port that nobody reads is given up, and not waited for."""
    monkeypatch.setattr(sending, "_PATIENCE", 0.2)
    with pytest.raises(InputError, match=r"takes no more bytes \(Write timeout\); look after the cable"):
        send(terminal[1], bytes(1 << 17))


def test_an_interrupt_closes_the_port(terminal, monkeypatch):
    serial = pytest.importorskip("serial")
    opened, make = [], serial.serial_for_url

    def watched(*arguments, **options):
        opened.append(make(*arguments, **options))
        opened[0].write = lambda data: (_ for _ in ()).throw(KeyboardInterrupt)
        return opened[0]

    monkeypatch.setattr(serial, "serial_for_url", watched)
    with pytest.raises(KeyboardInterrupt):
        send(terminal[1], bytes(9))
    assert not opened[0].is_open


@pytest.mark.parametrize("port", ["/dev/no-such-port", "/dev/null", "no://such"])
def test_a_port_that_is_none(port):
    pytest.importorskip("serial", reason="the Python package pyserial is not installed")
    with pytest.raises(
        InputError, match=rf"--port {port}: cannot be opened \(.+\); name the port of the board"
    ):
        send(port, b"a")
