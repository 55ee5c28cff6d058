"""Units that make and interpolate normals."""
