"""Records of the units in the rooms `cosines`."""
