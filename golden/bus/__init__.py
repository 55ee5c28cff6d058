"""Buses: layouts of bytes, frames of streams, and the map of the registers."""
