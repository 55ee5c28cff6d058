"""Records of the units: everything that a tool or a test needs to know of a unit, once."""
