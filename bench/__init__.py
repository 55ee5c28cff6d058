"""Benchmark layer: error against run time, measured, each speed as a ratio of two runs."""
