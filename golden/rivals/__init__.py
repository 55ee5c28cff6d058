"""Bit-accurate models of methods of other people, which have no hardware here, for comparisons."""
