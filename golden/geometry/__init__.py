"""Bit-accurate models of the units that turn triangles into spans and keep the nearest pixels."""
