"""Kinds of errors of a frame, each with the frame for comparison."""

__all__ = ["ERRORS", "reference_of"]

ERRORS = {
    "arithmetic": "the same method and model in float64",
    "method": "exact normals of every pixel, same model",
    "total": "exact normals of every pixel, model {}",
}
"""Frame for comparison, by the name of the error. ``{}`` stands for a model, see `reference_of`."""


def reference_of(error: str, target: str) -> str:
    """The frame for comparison of an error, in words.

    Parameters
    ----------
    error : str
        One of `ERRORS`.
    target : str
        Name of the exact model, see `target_of`.
    """
    return ERRORS[error].format(target)
