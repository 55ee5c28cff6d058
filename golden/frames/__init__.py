"""Frames: spans prepared for a pipeline, the bit-accurate pixels, and the errors of the pixels."""
