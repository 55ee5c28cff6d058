"""The report of error against run time."""
