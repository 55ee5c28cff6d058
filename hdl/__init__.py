"""Hardware layer: Amaranth components. Constants come from `golden`; meshes and engines are unknown here."""
