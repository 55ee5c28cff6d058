"""Speeds of engines, pipelines and the golden renderer, and cycles of frames by a model."""
