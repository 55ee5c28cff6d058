"""STL files: text and binary."""

import re
import struct

import numpy as np

from blysk.golden.reference.transfer import decode
from blysk.golden.text import is_wide, plain_text
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.parts import Part
from blysk.sim.meshes.refusal import Refused, shown

__all__ = ["read_stl"]

# Known first words of lines in a text file.
_KNOWN = {"solid", "endsolid", "facet", "endfacet", "normal", "outer", "loop", "endloop", "vertex", "end"}


def read_stl(data: bytes, found: Found, painted: bool) -> Part:
    """Triangles of an STL file, each with vertices of its own. Facet normals follow from the vertices.

    Facets of a binary file may have colours, 5 bits a channel, encoded by the curve of sRGB:

    - Red has the highest bits. Bit 15 says that there is a colour. (VisCAM, SolidView)
    - If the header has ``COLOR=`` with the colour of the solid, red has the lowest bits. Bit 15 says that the
      facet has the colour of the solid. If all attributes are 0, all facets have this colour. (Materialise)

    Parameters
    ----------
    data : bytes
        The file.
    found : Found
        Records contents that are not read.
    painted : bool
        Whether to read colours.

    Raises
    ------
    Refused
        If the file is cut short, or a facet of a text does not have three vertices of three numbers.
    """
    # The count in a binary file has a byte 0, unless the file has about 17 million triangles or more.
    text = is_wide(data) or b"\0" not in data.rstrip(b"\0")
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        text = False
    colors = None
    if text:
        vertices = _text(data, found)
    else:
        rows = _binary(data, found)
        vertices = rows["corners"].reshape(-1, 3).astype(np.float64)
        colors = _colors(rows["attribute"], data[:80], found) if painted else None
    return Part(0, vertices, np.arange(len(vertices)).reshape(-1, 3), colors=colors)


def _text(data: bytes, found: Found) -> np.ndarray:
    text = plain_text(data, "replace").lower().encode()
    solids = {True: 0, False: 0}

    def without_name(line):
        solids[line[1] is None] += 1
        return b""

    # A solid's name may hold any word.
    text = re.sub(
        rb"^[ \t]*+(end[ \t]*+)?solid\b(?:(?!\bfacet\s)[^\n])*+", without_name, text, flags=re.MULTILINE
    )
    if not solids[True] and b"facet" not in text:
        raise Refused("it is not an STL file: a text without solid and facet")
    ends = solids[False] or len(re.findall(rb"\bend[ \t]*+solid\b", text))
    if ends < max(solids[True], 1):
        raise Refused("it is cut short: the end of the solid is missing")
    first_words = set(re.findall(rb"^[ \t]*+([a-z_]++)", text, re.MULTILINE))
    found.tell_names("keywords", sorted(word.decode() for word in first_words), _KNOWN)
    if not {part.count(b"vertex") for part in text.split(b"facet")} <= {0, 3}:
        raise Refused("a facet does not have 3 vertices")
    numbers = re.findall(rb"\bvertex\s++(\S++)\s++(\S++)\s++(\S++)", text)
    if len(numbers) != text.count(b"vertex"):
        raise Refused("a vertex has fewer than 3 numbers")
    words = [word for row in numbers for word in row]
    if b"_" in b"".join(words):
        raise Refused("a vertex has a number with the character _")
    try:
        return np.fromiter(map(float, words), np.float64, len(words)).reshape(-1, 3)
    except ValueError as error:
        raise Refused(f"a vertex holds no number ({shown(str(error))})") from None


def _binary(data: bytes, found: Found) -> np.ndarray:
    """Rows of a normal, corners and an attribute."""
    if len(data) < 84:
        raise Refused(f"it is cut short: a binary STL has at least 84 bytes, but there are {len(data)}")
    (count,) = struct.unpack_from("<I", data, 80)
    size = 84 + 50 * count
    if len(data) < size:
        raise Refused(
            f"its size is wrong: the header says {count} triangles, which take {size} bytes, "
            f"but there are {len(data)}"
        )
    found.tell("byte after the last triangle", "bytes after the last triangle", len(data) - size)
    return np.frombuffer(
        data, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], count, 84
    )


def _colors(attributes: np.ndarray, header: bytes, found: Found) -> np.ndarray | None:
    """Colours of the facets' corners in linear light, shape (3 F, 3)."""
    flag = attributes >> 15 > 0
    solid = re.search(rb"COLOR=(.)(.)(.)(.)", header, re.DOTALL)
    shifts = (10, 5, 0) if solid is None else (0, 5, 10)
    codes = np.stack([attributes >> shift & 31 for shift in shifts], axis=1) / 31
    if solid is not None:
        *channels, alpha = (part[0] for part in solid.groups())
        codes[flag | ~attributes.any()] = np.array(channels) / 255
        if alpha != 255:
            found.tell("the alpha of its header")
    else:
        others = int((attributes[~flag] > 0).sum())
        found.tell("attribute that may be a colour", "attributes that may be colours", others)
        if not flag.any():
            return None
        codes[~flag] = 1
        found.tell("missing colour of a facet", "missing colours of facets", int((~flag).sum()))
    if b"MATERIAL=" in header:
        found.tell("the material of its header")
    return np.repeat(decode(codes), 3, axis=0)
