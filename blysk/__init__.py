"""blysk: Phong and Blinn shading as RTL in Amaranth, simulated beside a NumPy golden renderer."""
