"""Units that give each pixel its albedo."""
