"""Simulation engines: an array of beats in, an array of beats and their cycles out."""
