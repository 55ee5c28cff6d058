"""Kinds of errors of a frame, and the frame that each compares with."""

__all__ = ["ERRORS", "reference_of"]

ERRORS = {
    "arithmetic": "the same method and model in float64",
    "method": "exact normals of every pixel, same model",
    "total": "exact normals of every pixel, model {}",
}
"""Name of each error, and the frame that it compares with. ``{}`` stands for a model, see `reference_of`."""


def reference_of(error: str, target: str) -> str:
    """The frame that an error compares with, in words.

    Parameters
    ----------
    error : str
        One of `ERRORS`.
    target : str
        Name of the exact model, see `target_of`.
    """
    return ERRORS[error].format(target)
