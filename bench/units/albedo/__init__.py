"""Records of the units in the room `albedo`."""
