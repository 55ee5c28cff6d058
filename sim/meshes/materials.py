"""Materials of mesh files: values of a file, and the reflection coefficients made of them."""

from collections.abc import Callable, Collection, Container, Iterable, Sequence
from dataclasses import dataclass, field, replace

from blysk.golden.reference.lighting import Material, Triple
from blysk.golden.reference.texture import Texture
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, shown

__all__ = ["FileMaterial", "Found", "color_of", "surfaces"]

# k_a as a part of the file's k_d. Most MTL files have Ka 1, which would wash the picture out.
_AMBIENT_SHARE = 0.1
# From this metallic factor on, the albedo multiplies highlights, too, as of a metal.
_TINTED = 0.5
# Largest number of names of a kind in `Found.ignored`. Further names are counted.
_MOST_NAMES = 12

_SAID = ("ambient", "diffuse", "specular", "exponent", "roughness", "fresnel")
# If an option gives the first value of a pair, the file's second value has no effect.
_INSTEAD = (("diffuse", "ambient"), ("exponent", "roughness"), ("specular", "fresnel"))


@dataclass(frozen=True)
class FileMaterial:
    """Values of a file for a material. ``None``: the file has no value.

    Parameters
    ----------
    name : str
        Its name. Empty for faces without a material in the file.
    diffuse, specular : three floats or None
        Colours, each channel 0 to 1. They become k_d and k_s without conversion.
    exponent : int or None
        Exponent of the highlight, 1 to 1000.
    roughness : float or None
        Roughness, for the reflection models that have one in place of an exponent.
    fresnel, ambient : three floats or None
        F_0 of `Material`, and k_a. If k_a is ``None``, a tenth of the diffuse colour takes its place.
    two_sided : bool
        Whether its faces are seen from behind, too.
    texture : Texture or None
        Image that multiplies the diffuse colour.
    emission : three floats or None
        Light that the surface emits, 0 or more.
    unlit : bool
        Whether the surface shows its diffuse colour, whatever the lights.
    metallic : float or None
        Metallic factor, 0 to 1. The other values already have its effect on a surface of a single colour.
    colored : bool
        Whether colours of the vertices multiply the diffuse colour.
    alpha : float
        Alpha of the surface, 0 to 1.
    cutoff : float or None
        Least alpha that is drawn, see `Material`.
    """

    name: str = ""
    diffuse: Triple | None = None
    specular: Triple | None = None
    exponent: int | None = None
    roughness: float | None = None
    fresnel: Triple | None = None
    ambient: Triple | None = None
    two_sided: bool = False
    texture: Texture | None = None
    emission: Triple | None = None
    unlit: bool = False
    metallic: float | None = None
    colored: bool = False
    alpha: float = 1.0
    cutoff: float | None = None

    @classmethod
    def of_metallic_roughness(
        cls, name: str, base: Triple, metallic: float, roughness: float, two_sided: bool = False
    ) -> "FileMaterial":
        """A material from glTF's factors, each 0 to 1, see `Material.of_metallic_roughness`."""
        made = Material.of_metallic_roughness(base, metallic, roughness, _AMBIENT_SHARE)
        return replace(cls._of(name, made, two_sided), metallic=float(metallic))

    @classmethod
    def of_specular_glossiness(
        cls, name: str, diffuse: Triple, specular: Triple, glossiness: float, two_sided: bool = False
    ) -> "FileMaterial":
        """A material from specular and glossiness, each 0 to 1, see `Material.of_specular_glossiness`."""
        made = Material.of_specular_glossiness(diffuse, specular, glossiness, _AMBIENT_SHARE)
        return cls._of(name, made, two_sided)

    @classmethod
    def _of(cls, name: str, made: Material, two_sided: bool) -> "FileMaterial":
        return cls(name, **{said: getattr(made, said) for said in _SAID}, two_sided=two_sided)

    @property
    def has_albedo(self) -> bool:
        """Whether its colour differs from pixel to pixel."""
        return self.colored or self.texture is not None


@dataclass
class Found:
    """A file's materials, and a record of its contents that are not read.

    Material number 0 is for faces without a material.

    Parameters
    ----------
    names : list of str
        Names of the materials.
    readers : list of callable or None
        A function for each material, which returns the material. It is called if a face uses the material.
        ``None`` if the file lacks the material.
    """

    names: list[str] = field(default_factory=lambda: [""])
    readers: list[Callable[[], FileMaterial] | None] = field(default_factory=lambda: [None])
    _counts: dict[tuple[str, str], int] = field(default_factory=dict)
    _listed: dict[str, dict[str, None]] = field(default_factory=dict)

    def read(self, number: int) -> FileMaterial:
        """The material with a number."""
        reader = self.readers[number]
        return FileMaterial(shown(self.names[number])) if reader is None else reader()

    def tell(self, what: str, many: str = "", count: int = 1) -> None:
        """Record contents that are not read: in words, and, if ``many`` has the plural, by their number."""
        if count:
            self._counts[what, many] = self._counts.get((what, many), 0) + count

    def tell_names(self, kind: str, names: Iterable[str], known: Container[str] = ()) -> None:
        """Record the names of a kind that are not among the ``known`` names of a reader."""
        for name in names:
            if name not in known:
                self._listed.setdefault(kind, {})[shown(name)] = None

    @property
    def ignored(self) -> tuple[str, ...]:
        """The contents that are not read, in words: counts, then the names of each kind."""
        counts = [
            f"{count:,} {many if count > 1 else one}" if many else one
            for (one, many), count in self._counts.items()
        ]
        for kind, names in self._listed.items():
            shown_names = list(names)[:_MOST_NAMES]
            if len(names) > _MOST_NAMES:
                shown_names.append(f"{len(names) - _MOST_NAMES} more")
            counts.append(f"{kind}: {', '.join(shown_names)}")
        return tuple(counts)


def color_of(channels: list[float], what: str, name: str, text: str, many: str = "three") -> Triple:
    """A colour of a material; `Refused`, with the file's text, if it is not three numbers from 0 to 1.

    The message says how ``many`` numbers the format demands: four, if it has alpha.
    """
    if len(channels) != 3 or not all(0 <= channel <= 1 for channel in channels):
        raise Refused(
            f"material {name!r} has {what} {shown(text)!r}, not {many} numbers from 0 to 1", ONE_MATERIAL
        )
    return tuple(map(float, channels))


def surfaces(
    materials: Sequence[FileMaterial], default: Material, fixed: Collection[str] = ()
) -> tuple[Material, ...]:
    """Reflection coefficients of a mesh's materials, from the file's values or from a default.

    k_d is the file's diffuse colour, k_s its specular colour, and k_a a tenth of the diffuse or base colour.
    If ``fixed`` has the exponent, the file's roughness does not count. In the same way the specular colour
    excludes the file's F_0, and the diffuse colour its k_a.

    Colours of vertices and textures multiply the diffuse colour, also if an option gives it. If a material
    has these colours, and no diffuse colour, its diffuse colour is white. Colours of vertices and textures
    multiply highlights, too, if the metallic factor is 1/2 or more. An emission over 1 counts as 1, which
    already gives the brightest pixel.

    Parameters
    ----------
    materials : sequence of FileMaterial
        Materials of `load_mesh`.
    default : Material
        Coefficients for materials whose file does not give them.
    fixed : collection of str
        Fields of ``default`` that replace the values of all materials: ``"diffuse"`` and so on.
    """
    result = []
    for material in materials:
        said = {name: getattr(material, name) for name in _SAID}
        if material.has_albedo and material.diffuse is None:
            said["diffuse"] = (1.0, 1.0, 1.0)
        if said["diffuse"] is not None and material.ambient is None:
            said["ambient"] = tuple(_AMBIENT_SHARE * channel for channel in said["diffuse"])
        hidden = {*fixed, *(other for name, other in _INSTEAD if name in fixed)}
        said = {name: value for name, value in said.items() if value is not None and name not in hidden}
        looks = {
            name: getattr(material, name) for name in ("two_sided", "texture", "unlit", "alpha", "cutoff")
        }
        looks["tinted"] = material.has_albedo and (material.metallic or 0.0) >= _TINTED
        if material.emission is not None:
            looks["emission"] = tuple(min(channel, 1.0) for channel in material.emission)
        result.append(replace(default, **said, **looks))
    return tuple(result)
