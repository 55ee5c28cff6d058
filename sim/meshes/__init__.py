"""Meshes: the files of the world, and the teapot's patches."""
