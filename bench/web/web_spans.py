"""Spans of the live page as bytes."""

import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from blysk.golden.pipeline import Spans

__all__ = ["COLUMNS", "encode"]


COLUMNS = (
    *({"name": name, "bytes": 2, "bias": 1 << 15, "running": True} for name in ("x", "y")),
    {"name": "length", "bytes": 2, "bias": 0},
    *({"name": f"normal_left.{c}", "bytes": 3, "bias": 1 << 23} for c in range(3)),
    *(
        {"name": f"normal_right.{c}", "bytes": 3, "bias": 1 << 23, "from": f"normal_left.{c}"}
        for c in range(3)
    ),
    {"name": "ratio", "bytes": 3, "bias": 1 << 23},
    *(
        column
        for line in ("attributes.start", "attributes.step")
        for column in (
            {"name": f"{line}.weight", "bytes": 3, "bias": 1 << 23},
            *(
                {"name": f"{line}.colors.{c}", "bytes": 4, "bias": 1 << 24, "from": f"{line}.weight"}
                for c in range(3)
            ),
            *({"name": f"{line}.coordinates.{c}", "bytes": 3, "bias": 1 << 23} for c in range(2)),
        )
    ),
    *({"name": f"attributes.{name}", "bytes": 1, "bias": 0} for name in ("exponent", "range", "level")),
    *({"name": f"attributes.base.{c}", "bytes": 2, "bias": 1 << 15} for c in range(2)),
)
"""Columns of the spans in a file, one column for each field. Spans without an albedo lack ``attributes``.

A column has the codes of its field. With ``running`` it has their change from the previous span, with
``from`` their difference from another column. ``bias`` is added, so that no number is negative. A number
takes ``bytes`` bytes.

``ratio`` is ``round(2^19 log2(m_r / m_l))``, where m_l and m_r are the lengths of the interpolated normals at
the ends. For a method whose own curve is exact, ``ratio`` is 0."""


def encode(spans: Spans, visible: np.ndarray, ratio: np.ndarray | float = 1.0) -> bytes:
    """Spans of a view, and the visibility of their fragments, as bytes compressed by zlib.

    The bytes are, in this order:

    - the numbers of spans, of fragments and of columns, 32 bits each;
    - the first of the `COLUMNS`, in this number: of each column the lowest byte of all codes, then the next
      byte of all codes;
    - a bit for each fragment. A byte is filled from its lowest bit on.

    Parameters
    ----------
    spans : Spans
        Spans with normals.
    visible : bool array
        Whether each fragment is visible, in the order of the fragments.
    ratio : array, shape (spans,), optional
        Length of the interpolated normal at the right end, divided by its length at the left end.
    """
    logarithm = np.clip(np.log2(np.broadcast_to(ratio, len(spans))), -15, 15)
    codes = {"x": spans.x, "y": spans.y, "length": spans.length, "ratio": np.rint(2**19 * logarithm)}
    for name, normal in (("left", spans.normal_left), ("right", spans.normal_right)):
        codes |= {f"normal_{name}.{c}": normal[:, c] for c in range(3)}
    if spans.attributes is not None:
        codes |= _by_path("attributes", spans.attributes.beats)
    columns = [column for column in COLUMNS if column["name"] in codes]
    parts = [np.array([len(spans), len(visible), len(columns)], dtype="<u4").tobytes()]
    for column in columns:
        values = np.asarray(codes[column["name"]], dtype=np.int64)
        if "from" in column:
            values = values - codes[column["from"]]
        elif "running" in column:
            values = np.diff(values, prepend=0)
        split = (values + column["bias"]).astype("<u4").view(np.uint8).reshape(-1, 4)
        parts += [split[:, byte].tobytes() for byte in range(column["bytes"])]
    parts.append(np.packbits(visible, bitorder="little").tobytes())
    return zlib.compress(b"".join(parts), 9)


def _by_path(path: str, beats: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Codes of nested beats, with names and indices with dots between them."""
    if isinstance(beats, Mapping):
        for name, inner in beats.items():
            yield from _by_path(f"{path}.{name}", inner)
    elif beats.ndim == 2:
        yield from ((f"{path}.{index}", codes) for index, codes in enumerate(beats.T))
    else:
        yield path, beats
