"""Hardware layer: Amaranth components. Constants come from `golden`. Meshes and engines are unknown here."""
