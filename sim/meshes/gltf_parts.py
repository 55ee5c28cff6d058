"""Parts of glTF documents: checked references, extensions, views, and data in texts."""

import base64
import binascii
import math
import re
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from blysk.sim.meshes.refusal import REEXPORT, Refused, shown

__all__ = [
    "MESHOPT",
    "data_of_uri",
    "extension_of",
    "has_extension",
    "holds_data",
    "listed",
    "view_bytes",
    "whole",
]

MESHOPT = {"EXT_meshopt_compression", "KHR_meshopt_compression"}
"""Extensions that compress views, and have no decoder here. A view is read if its plain data is there."""


def has_extension(part: dict, name: str) -> bool:
    """Whether a part of a document has an extension."""
    extensions = part.get("extensions", {})
    return isinstance(extensions, dict) and name in extensions


def extension_of(part: dict, name: str) -> dict:
    """An extension of a part of a document; empty if the part does not have the extension."""
    extension = part["extensions"][name] if has_extension(part, name) else {}
    return extension if isinstance(extension, dict) else {}


def listed(document: dict, name: str) -> list[dict]:
    """A list of objects of a document; `Refused` if the value is not a list of objects."""
    rows = document.get(name, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Refused(f"its {name} are not a list of objects")
    return rows


def whole(value: Any, what: str, below: float = math.inf, remedy: str = REEXPORT) -> int:
    """A whole number of at least 0. Others are `Refused`: Python counts a negative index from the end."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise Refused(f"it has {what} {shown(str(value))}, not a whole number of at least 0", remedy)
    if value >= below:
        raise Refused(f"it has {what} {value}, counted from 0, but there are only {below}", remedy)
    return value


def holds_data(uri: str) -> bool:
    """Whether a reference holds the data itself (RFC 2397), and names no file."""
    return uri[:5].lower() == "data:"


def data_of_uri(uri: str, what: str, remedy: str = REEXPORT) -> bytes:
    """Bytes that the text of a reference holds: base64, or the characters themselves.

    Both may have codes with ``%``. Base64 may have spaces, and may lack its padding. `Refused` if other
    characters are in base64.
    """
    head, _, text = uri.partition(",")
    if not re.search(r";\s*base64\s*$", head, re.IGNORECASE):
        return unquote_to_bytes(text)
    text = "".join(unquote(text).split()).rstrip("=")
    try:
        return base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise Refused(f"the text of {what} is not base64", remedy) from None


def view_bytes(view: dict, buffers: list[bytes]) -> bytes:
    """Bytes of a view; `Refused` if only their compressed form is there."""
    data = buffers[view["buffer"]][view.get("byteOffset", 0) :][: view["byteLength"]]
    compressed = sorted(MESHOPT.intersection(view.get("extensions", {})))
    if len(data) < view["byteLength"] and compressed:
        raise Refused(
            f"it is compressed with {compressed[0]}, for which there is no decoder",
            "export it uncompressed",
        )
    return data
