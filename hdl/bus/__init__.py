"""Buses: AXI4-Stream, AXI4-Lite and Wishbone round a core."""
