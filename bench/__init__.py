"""Benchmark layer: measured errors, costs and run times; each speed is a ratio of two runs."""
