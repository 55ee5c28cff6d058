"""What keeps the quality: mutants, soak, baselines, sweep."""
