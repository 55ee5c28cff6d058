"""Bit-accurate models of the units that give each pixel its albedo."""
