"""Interpolation methods: from a span to the operands of its pixels."""
