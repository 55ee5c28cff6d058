"""Units of the display side: timing, bands of colour, TMDS, serial lanes."""
