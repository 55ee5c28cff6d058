"""Materials of mesh files: what a file says, and the reflection coefficients that follow."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace

from blysk.golden.reference.lighting import Material, Triple
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, shown

__all__ = ["FileMaterial", "Found", "color_of", "surfaces"]

# k_a of a material whose k_d is the file's: most MTL files have a Ka of 1, which would wash the picture out.
_AMBIENT_SHARE = 0.1


@dataclass(frozen=True)
class FileMaterial:
    """What a file says of a material; ``None`` where it says nothing.

    Parameters
    ----------
    name : str
        Its name; empty for faces that have no material in the file.
    diffuse, specular : three floats or None
        Colours, each channel 0 to 1: factors of k_d and k_s, as they stand.
    exponent : int or None
        Exponent of the highlight, 1 to 1000.
    """

    name: str = ""
    diffuse: Triple | None = None
    specular: Triple | None = None
    exponent: int | None = None


@dataclass
class Found:
    """A file's materials: number 0 for faces without one, then its own; and what of the file is not read.

    Parameters
    ----------
    names : list of str
        Names of the materials.
    readers : list of callable or None
        Of each, what reads it, when a face uses it, and gives the material and how many textures it has.
    ignored : list of str
        What is not read, in words.
    """

    names: list[str] = field(default_factory=lambda: [""])
    readers: list[Callable[[], tuple[FileMaterial, int]] | None] = field(default_factory=lambda: [None])
    ignored: list[str] = field(default_factory=list)

    def read(self, number: int) -> tuple[FileMaterial, int]:
        """One material and how many textures it has."""
        reader = self.readers[number]
        return (FileMaterial(shown(self.names[number])), 0) if reader is None else reader()


def color_of(channels: list[float], what: str, name: str, text: str) -> Triple:
    """A colour of a material; `Refused`, with the text of the file, if it is none."""
    if len(channels) != 3 or not all(0 <= channel <= 1 for channel in channels):
        raise Refused(
            f"material {name!r} has {what} {shown(text)!r}, not three numbers from 0 to 1", ONE_MATERIAL
        )
    return tuple(map(float, channels))


def surfaces(
    materials: Sequence[FileMaterial], default: Material, fixed: Collection[str] = ()
) -> tuple[Material, ...]:
    """Reflection coefficients of a mesh's materials: what the file says, before a default.

    The file's diffuse colour is k_d, and a tenth of it k_a; its specular colour is k_s.

    Parameters
    ----------
    materials : sequence of FileMaterial
        Of `load_mesh`.
    default : Material
        Coefficients where the file says nothing.
    fixed : collection of str
        Fields of ``default`` that hold for all materials, whatever the file says: ``"diffuse"`` and so on.
    """
    result = []
    for material in materials:
        color = None if "diffuse" in fixed else material.diffuse
        said = {
            "ambient": color and tuple(_AMBIENT_SHARE * channel for channel in color),
            "diffuse": color,
            "specular": material.specular,
            "exponent": material.exponent,
        }
        said = {name: value for name, value in said.items() if value is not None and name not in fixed}
        result.append(replace(default, **said))
    return tuple(result)
