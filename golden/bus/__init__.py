"""Buses: layouts of bytes, framing of streams, and the map of the registers."""
