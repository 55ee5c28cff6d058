"""STL files that are cut short, which trimesh would load in part."""

import struct

from blysk.sim.meshes.refusal import Refused, utf8

__all__ = ["tidy_stl"]


def tidy_stl(data: bytes) -> bytes:
    """The bytes of an STL file; `Refused` if it is cut short, where trimesh says at most that it is empty."""
    if data[:5].lower() == b"solid" and b"\0" not in data:
        if b"endsolid" not in data.lower():
            raise Refused("it is cut short: the end of the solid is missing")
        return utf8(data)
    if len(data) < 84:
        raise Refused(f"it is cut short: a binary STL has at least 84 bytes, there are {len(data)}")
    count = struct.unpack_from("<I", data, 80)[0]
    if len(data) != 84 + 50 * count:
        raise Refused(
            f"its size is wrong: the header says {count} triangles, which take {84 + 50 * count} bytes, "
            f"there are {len(data)}"
        )
    return data
