"""Frames: a scene through the simulated pipeline."""
