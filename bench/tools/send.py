"""Sends the words of a mesh to a board with a loader, or writes them to a file."""

import os
from types import ModuleType

from blysk.golden.bus.loader import BAUD
from blysk.sim.cli.progress import progress
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

__all__ = ["send", "serial_library"]

_PIECE = 1024
"""Bytes that are given to the port in one step."""

_PATIENCE = 5.0
"""Seconds after which a port that takes no byte is given up."""


def serial_library() -> ModuleType:
    """The library of serial ports.

    Raises
    ------
    InputError
        If pyserial is not installed.
    """
    try:
        import serial
    except ModuleNotFoundError as error:
        raise InputError("--port", "pyserial is not installed", install_extra("loader")) from error
    return serial


def send(port: str, data: bytes) -> None:
    """Send bytes by a serial port, with progress. An interrupt leaves the port closed and empty.

    Parameters
    ----------
    port : str
        Name of the port, or a URL of pyserial.
    data : bytes
        The bytes.

    Raises
    ------
    InputError
        If pyserial is not installed, the port cannot be opened, or it takes no more bytes.
    """
    serial = serial_library()
    thing = f"--port {port}"
    try:
        line = serial.serial_for_url(port, baudrate=BAUD, write_timeout=_PATIENCE)
    except (serial.SerialException, OSError, ValueError) as error:
        remedy = "name the port of the board, such as /dev/ttyUSB0, and close programs that use it"
        raise InputError(thing, f"cannot be opened ({_reason(error)})", remedy) from error
    with line, progress(total=len(data), unit="bytes", scaled=True) as bar:
        try:
            for start in range(0, len(data), _PIECE):
                piece = data[start : start + _PIECE]
                line.write(piece)
                bar.update(len(piece))
            line.flush()
        except (serial.SerialException, OSError) as error:
            line.reset_output_buffer()
            reason = f"takes no more bytes ({_reason(error)})"
            raise InputError(thing, reason, "look after the cable, and send again") from error
        except BaseException:
            line.reset_output_buffer()
            raise


def _reason(error: BaseException) -> str:
    """The message of the system, or else of pyserial."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)
