"""Checks of quality: mutants, soak, baselines, sweep."""
