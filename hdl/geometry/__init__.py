"""Units that turn triangles into spans and keep the nearest pixels."""
