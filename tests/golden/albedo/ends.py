"""Ends of spans of attributes, for the tests of their models."""

import numpy as np

__all__ = ["ends_of"]


def ends_of(rng, model, length, ratio, crossed=512.0):
    """Attributes and 1/W at both ends. Some colours are 0 or 1 at an end."""
    count = len(length)
    colors = rng.random((2, count, 3))
    colors[:, ::3] = np.rint(colors[:, ::3])
    places = rng.uniform(-900, 900, (2, count, 2))
    places[1] = places[0] + rng.uniform(-1, 1, (count, 2)) * crossed * 2.0 ** -rng.uniform(0, 12, (count, 1))
    ends = [part for part, has in ((colors, model.colors), (places, model.coordinates)) if has]
    near = 2.0 ** rng.uniform(-30, 30, count)
    far = near * np.where(rng.random(count) < 0.5, ratio, 1 / ratio)
    return np.concatenate(ends, axis=2), (near, far) if model.perspective else None
