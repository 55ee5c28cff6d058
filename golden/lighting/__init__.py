"""Bit-accurate models of the units from cosines to colours: terms, gates, intensity."""
