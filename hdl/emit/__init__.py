"""Verilog of a component, and the count of its parts."""
