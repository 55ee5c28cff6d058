"""Names of operands that commands of other packages still use."""

HIGHLIGHTS = ("dot", "chord")
"""Forms of the specular argument."""
