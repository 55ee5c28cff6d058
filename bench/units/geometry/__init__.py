"""Records of the units of geometry."""
