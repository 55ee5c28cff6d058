"""Speeds, each as a ratio of two runs: engines, throughput, the golden renderer."""
