"""Records of the units in the rooms `methods`."""
