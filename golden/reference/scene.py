"""Scenes: mesh, camera, size, materials and lights of a picture."""

import operator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light, Triple, color_triple
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.texture import Texture

__all__ = ["BACK_FACES", "LARGEST_SIDE", "VIEWERS", "Scene"]

BACK_FACES = ("flip", "show", "cull")
"""Ways to treat a triangle seen from behind."""

VIEWERS = ("distant", "near")
"""Viewers for the lighting: one direction for the whole frame, or the position of the camera."""

LARGEST_SIDE = 4095
"""Largest width and height: x, y and a span's length are 12 bits each."""


@dataclass(frozen=True)
class Scene:
    """A scene: the surface and all that its picture depends on.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    camera : Camera
        The viewer.
    width, height : int
        Pixels, 1 to 4095 each.
    material : Material or sequence of Material
        Coefficients of the surface: one material, or several materials that `Mesh.material` chooses from.
        Stored as a tuple.
    lights : sequence of Light
        Any number, directional or point lights; stored as a tuple.
    ambient_light : three floats, float or str
        I_a, at least 0: three numbers, one number for all channels, or ``"#rrggbb"`` in sRGB.
        Stored as three floats of linear light.
    background : three floats, float or str
        Colour of the pixels that show no surface, in [0, 1], in the same forms.
    back_faces : {"flip", "show", "cull"}
        Treatment of a triangle seen from behind (its corners are clockwise).

        - ``"flip"`` draws it with negated normals, which point to the viewer's side.
        - ``"show"`` draws it with its own normals.
        - ``"cull"`` leaves it out. If its material is two-sided, ``"cull"`` draws it with negated normals.
    viewer : {"distant", "near"}
        Vector V for the lighting. ``"distant"`` is `Camera.viewer` everywhere, ``"near"`` the direction from
        each point of the surface to a perspective camera.

    Raises
    ------
    ValueError
        If a value is out of range, or a face has the index of a missing material. If the viewer is near and
        the camera orthographic. If a face has a texture, and the mesh no texture coordinates.
    TypeError
        If a size is not an integer, a light is not a `Light` or a material is not a `Material`.
    """

    mesh: Mesh
    camera: Camera
    width: int
    height: int
    material: Material | tuple[Material, ...]
    lights: tuple[Light, ...]
    ambient_light: Triple = (1.0, 1.0, 1.0)
    background: Triple = (0.0, 0.0, 0.0)
    back_faces: str = "flip"
    viewer: str = "distant"

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = operator.index(getattr(self, name))
            if not 1 <= size <= LARGEST_SIDE:
                raise ValueError(f"a scene's {name} must be in 1 to {LARGEST_SIDE}, not {size}")
            object.__setattr__(self, name, size)
        object.__setattr__(self, "lights", tuple(self.lights))
        for light in self.lights:
            if not isinstance(light, Light):
                raise TypeError(f"a scene's lights must be Light, not {type(light).__name__}")
        if not isinstance(self.material, Material):
            object.__setattr__(self, "material", tuple(self.material))
        for material in self.materials:
            if not isinstance(material, Material):
                raise TypeError(f"a scene's materials must be Material, not {type(material).__name__}")
        used = 1 + self.mesh.material.max(initial=0)
        if len(self.materials) < used:
            raise ValueError(f"the mesh has faces of {used} materials, the scene {len(self.materials)}")
        if self.textures and not self.mesh.coordinates.size:
            raise ValueError(
                "the material of a face has a texture, and the mesh has no texture coordinates: "
                "give coordinates, or a material without texture"
            )
        object.__setattr__(self, "ambient_light", color_triple("a scene's ambient_light", self.ambient_light))
        object.__setattr__(self, "background", color_triple("a scene's background", self.background, 0, 1))
        if self.back_faces not in BACK_FACES:
            raise ValueError(f"back_faces must be one of {', '.join(BACK_FACES)}, not {self.back_faces!r}")
        if self.viewer not in VIEWERS:
            raise ValueError(f"viewer must be one of {', '.join(VIEWERS)}, not {self.viewer!r}")
        if self.viewer == "near" and self.camera.projection != "perspective":
            raise ValueError("a near viewer needs a perspective camera, not an orthographic camera")

    @property
    def local(self) -> bool:
        """Whether L or H differs from point to point: there is a point light or a near viewer."""
        return self.viewer == "near" or any(light.is_local for light in self.lights)

    @property
    def lit(self) -> "Scene":
        """The scene without the lights that are off."""
        on = tuple(light for light in self.lights if light.is_on)
        return self if len(on) == len(self.lights) else replace(self, lights=on)

    @cached_property
    def textures(self) -> dict[int, Texture]:
        """Texture of each material that faces have and that has a texture, by the material's index."""
        given = {index: of.texture for index, of in enumerate(self.materials) if of.texture is not None}
        used = np.unique(self.mesh.material).tolist() if given else []
        return {index: given[index] for index in used if index in given}

    @property
    def has_albedo(self) -> bool:
        """Whether the surface has vertex colours or a texture."""
        return bool(self.mesh.colors.size or self.textures)

    @property
    def cutoffs(self) -> dict[int, Material]:
        """Each material that faces have and that has a cutoff, by its index."""
        given = {index: of for index, of in enumerate(self.materials) if of.cutoff is not None}
        used = np.unique(self.mesh.material).tolist() if given else []
        return {index: given[index] for index in used if index in given}

    @property
    def culls(self) -> np.ndarray:
        """Whether each triangle is left out if it is seen from behind: bool array, shape (faces,)."""
        return (self.back_faces == "cull") & ~self.two_sided

    @property
    def flips(self) -> np.ndarray:
        """Whether each triangle has its normals negated if it is seen from behind: shape (faces,)."""
        return (self.back_faces == "flip") | (self.back_faces == "cull") & self.two_sided

    @property
    def two_sided(self) -> np.ndarray:
        """Whether each triangle's material is two-sided: bool array, shape (faces,)."""
        found: np.ndarray = np.array([material.two_sided for material in self.materials])[self.mesh.material]
        return found

    @property
    def distant_viewer(self) -> np.ndarray | None:
        """Unit vector V to a distant viewer; ``None`` if the viewer is near."""
        return self.camera.viewer if self.viewer == "distant" else None

    def view_vectors(self, points: np.ndarray | None = None) -> np.ndarray:
        """Unit vectors V from points of the surface to the viewer.

        Parameters
        ----------
        points : array, shape (..., 3), optional
            Points; a distant viewer does not read them.

        Returns
        -------
        float64 array
            Shape (3,) for a distant viewer, else the shape of the points; 0 at the camera itself.

        Raises
        ------
        ValueError
            If a near viewer is given no points.
        """
        if self.viewer == "distant":
            return self.camera.viewer
        if points is None:
            raise ValueError("a near viewer needs the points that it sees")
        return normalise(np.asarray(self.camera.position) - points)

    @property
    def materials(self) -> tuple[Material, ...]:
        """All materials, as a tuple."""
        return (self.material,) if isinstance(self.material, Material) else self.material
