"""Tools for a designer: unit table and pages, sweeps of designs, place and route."""
