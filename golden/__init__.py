"""Golden layer: float64 reference, tables and polynomial fits, bit-accurate models. NumPy only."""
