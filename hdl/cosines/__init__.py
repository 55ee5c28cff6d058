"""Units that make N·L and N·H, or 1 - N·H, along a span."""
