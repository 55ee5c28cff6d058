"""Meshes: readers of mesh files, and the teapot."""
