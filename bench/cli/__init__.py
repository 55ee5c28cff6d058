"""Commands of this layer: options and their checks. Then a command imports the code for its work."""
