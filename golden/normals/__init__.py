"""Bit-accurate models of the units that make and interpolate normals."""
