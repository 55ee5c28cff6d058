"""Frames: spans prepared for a pipeline, its bit-accurate pixels, and their errors."""
