"""Records of the units of the display side."""
