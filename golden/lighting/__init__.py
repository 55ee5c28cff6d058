"""Bit-accurate models of the units that make light of operands."""
