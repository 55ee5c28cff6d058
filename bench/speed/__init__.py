"""Speeds, each as a ratio of two runs: engines, pipelines, the golden renderer; cycles of frames by a model."""
