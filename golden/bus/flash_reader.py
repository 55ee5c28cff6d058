"""Flash reader: the bytes of a serial flash from an offset to their end mark."""

from dataclasses import dataclass

from blysk.golden.bus.packets import END, FLAG

__all__ = ["READ", "FlashReader"]

READ = 0x03
"""Command of a serial flash: read from an address of three bytes, the highest first."""


@dataclass(frozen=True)
class FlashReader:
    """Reads a serial flash once after power-up.

    The bytes must begin with `FLAG`. If they begin with another byte, the flash holds nothing. The byte `END`
    ends them. Erased flash has this value.

    Parameters
    ----------
    offset : int
        Address of the first byte, 0 to 2^24 - 1.

    Raises
    ------
    ValueError
        If the address has more than 24 bits.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    offset: int

    def __post_init__(self) -> None:
        if not 0 <= self.offset < 1 << 24:
            raise ValueError(f"an address of a flash is 0 to {(1 << 24) - 1}, not {self.offset}")

    @property
    def command(self) -> int:
        """The 32 bits that are sent first, the highest bit first."""
        return READ << 24 | self.offset

    def compute(self, contents: bytes) -> bytes:
        """The bytes that are given on.

        Parameters
        ----------
        contents : bytes
            Contents of the flash from the offset on.
        """
        return contents.partition(bytes((END,)))[0] if contents[:1] == bytes((FLAG,)) else b""
