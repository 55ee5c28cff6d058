"""Records of the units: the one place for everything that tools and tests need to know of a unit."""
