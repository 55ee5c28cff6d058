"""Records of the units of buses."""
