"""Commands of this layer: options, their checks, and then the import of what does the work."""
