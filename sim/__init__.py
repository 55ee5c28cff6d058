"""Simulation layer: engines, meshes, scenes, spans, the frame runner and the command line."""
