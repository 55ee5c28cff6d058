"""Exceptions of this room."""

__all__ = ["NetlistError"]


class NetlistError(RuntimeError):
    """Yosys could not read or write a netlist."""
