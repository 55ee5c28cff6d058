"""Bit-accurate models of the units that turn cosines into light."""
