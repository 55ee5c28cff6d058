"""Units that make light of operands."""
