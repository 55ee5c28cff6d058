"""Golden layer: float64 reference, tables and polynomial fits, bit-true twins. NumPy only."""
