"""Attributes of spans, and constants of materials, for a design with an albedo."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.levels import texel_places
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

__all__ = [
    "MOST_TEXELS",
    "albedo_of",
    "check_albedo",
    "design_for",
    "fixed_albedo_of",
    "one_level",
    "span_attributes",
    "with_albedo",
]

MOST_TEXELS = 62
"""Texels that a span of several pixels crosses at most, along u and along v. Their ``range`` is 5 or less."""

_WHITE = Texture(np.ones((1, 1, 3)), filter="nearest")
"""Texture of materials without a texture."""

_LEAST_DEPTH = 1536
"""Words of a bank that hold 64x64 texels and their levels."""


def albedo_of(scene: Scene) -> Albedo | None:
    """The albedo path that a scene needs; ``None`` if its surface has neither vertex colours nor textures.

    The depth of the texel memory is the least that holds the textures, of 1536 words times a power of 4.
    """
    if not scene.has_albedo:
        return None
    texture = None
    if scene.textures:
        bilinear = any(of.filter == "bilinear" for of in scene.textures.values())
        largest = TexelMemory(TexelMemory.LARGEST)
        words, depth = len(largest.load(_textures(scene)).codes), _LEAST_DEPTH
        while depth < words:
            depth *= 4
        texture = TextureSampler(TexelMemory(min(depth, TexelMemory.LARGEST)), bilinear=bilinear)
    return Albedo(
        colors=bool(scene.mesh.colors.size),
        texture=texture,
        perspective=scene.camera.projection == "perspective",
        tints=any(of.tinted for of in scene.materials),
    )


def fixed_albedo_of(scene: Scene, has_highlights: bool = True) -> Albedo | None:
    """The albedo path for a scene whose texels are fixed at build time, and whose spans bring 1/W.

    Parameters
    ----------
    scene : Scene
        The scene.
    has_highlights : bool
        Whether the design has highlights. Only then materials may be tinted.

    Raises
    ------
    ValueError
        If the textures do not fit the largest texel memory.
    """
    found = albedo_of(scene)
    if found is None:
        return None
    found = replace(found, perspective=True, tints=found.tints and has_highlights)
    if found.texture is None:
        return found
    memory = TexelMemory.holding(_textures(scene))
    return replace(found, texture=replace(found.texture, memory=memory))


def one_level(scene: Scene, level: int = 0) -> Scene:
    """The scene with one level of each texture as its image, and no other levels.

    Parameters
    ----------
    scene : Scene
        The scene. An image that has fewer levels has its last level, also if the texture takes none.
    level : int
        Number of the level, 0 for the image itself.
    """
    images: dict[int, np.ndarray] = {}

    def of(material: Material) -> Material:
        texture = material.texture
        if texture is None:
            return material
        full = replace(texture, mipmapped=True)
        number = min(level, len(full.levels) - 1)
        # Textures that share an image go on sharing it.
        image = images.setdefault(id(texture.texels), full.levels[number])
        alpha = full.alpha_levels[number][..., 0] if texture.alpha.size else texture.alpha
        return replace(material, texture=replace(texture, texels=image, alpha=alpha, mipmapped=False))

    return replace(scene, material=tuple(map(of, scene.materials)))


def design_for(
    design: ShadingPipeline, scene: Scene, scaled: bool = True, triangles: bool = False
) -> ShadingPipeline:
    """The same design for the materials, vertex colours and textures of a scene.

    Parameters
    ----------
    design : ShadingPipeline
        The design.
    scene : Scene
        The scene.
    scaled : bool
        As for `ShadingPipeline.for_materials`.
    triangles : bool
        Whether spans come from hardware geometry, which gives 1/W in an orthographic scene, too.

    Raises
    ------
    ValueError
        If the textures do not fit the largest texel memory.
    """
    albedo = albedo_of(scene)
    if albedo is not None and triangles:
        albedo = replace(albedo, perspective=True)
    if albedo is not None and not design.has_highlights:
        albedo = replace(albedo, tints=False)
    return replace(design.for_materials(scene.materials, scaled), albedo=albedo)


def check_albedo(scene: Scene, design: ShadingPipeline) -> None:
    """Refuse a scene whose surface has colours that the design cannot show.

    Raises
    ------
    ValueError
        If the design lacks a part that the scene needs.
    """
    albedo = design.albedo
    tinted = any(of.tinted for of in scene.materials) and design.has_highlights
    for what, needed, there in (
        ("vertex colours", bool(scene.mesh.colors.size), albedo is not None and albedo.colors),
        ("textures", bool(scene.textures), albedo is not None and albedo.texture is not None),
        ("a tinted material", scene.has_albedo and tinted, albedo is not None and albedo.tints),
    ):
        if needed and not there:
            raise ValueError(f"the scene has {what}, and the design does not: make it with design_for")
    perspective = scene.camera.projection == "perspective"
    if albedo is not None and perspective and not albedo.perspective:
        raise ValueError(
            "the albedo of the design is orthographic, and the camera is not: make it with design_for"
        )


def with_albedo(
    constants: Sequence[FrameConstants], scene: Scene, design: ShadingPipeline
) -> list[FrameConstants]:
    """Frame constants with emission, tint, texture and texels, for a design with an albedo.

    Parameters
    ----------
    constants : sequence of FrameConstants
        Constants of each material.
    scene : Scene
        Materials and textures. Without an albedo its emission is in the ambient colours.
    design : ShadingPipeline
        The pipeline.

    Raises
    ------
    ValueError
        If textures do not fit, or are not the fixed textures, or the light on a surface is over the limit of
        `Intensity`.
    """
    albedo = design.albedo
    assert albedo is not None
    found = []
    for index, (of, material) in enumerate(zip(constants, scene.materials, strict=True)):
        tinted = material.tinted and scene.has_albedo
        most = of.ambient + of.diffuse.sum(axis=0) + (of.specular.sum(axis=0) if tinted else 0)
        if most.max() > Intensity.SURFACE_FORMAT.max_code:
            raise ValueError(
                f"the lights of material {index} add up to {most.max() / (255 << 6):.3g} times the full "
                "channel, and a surface with an albedo takes 16: lower the light"
            )
        emission = Intensity.color(np.array(material.emission if scene.has_albedo else (0, 0, 0)))
        found.append(replace(of, emission=emission, tinted=tinted if albedo.tints else None))
    if albedo.texture is not None:
        memory = albedo.texture.memory
        loaded = memory.load(_textures(scene))
        found = [replace(of, texture=its) for of, its in zip(found, loaded.descriptors, strict=True)]
        if memory.fixed is None:
            found[0] = replace(found[0], texels=loaded)
        elif not np.array_equal(loaded.codes, memory.fixed.codes):
            raise ValueError("the texels of the design are fixed, and the scene has other textures")
    return found


def _textures(scene: Scene) -> list[Texture]:
    """Texture of each material."""
    return [scene.textures.get(index, _WHITE) for index in range(len(scene.materials))]


def span_attributes(scene: Scene, cut: Raster, albedo: Albedo) -> SpanAttributes:
    """Attributes of spans at their ends, quantised.

    Parameters
    ----------
    scene : Scene
        Mesh, materials and camera.
    cut : Raster
        Spans of `cut_by_attributes`, with their weights, and with the levels of textures that have several.
    albedo : Albedo
        The albedo path.

    Raises
    ------
    ValueError
        If spans have to be cut for `SpanAttributes.quantise`.

    Notes
    -----
    Far outside a clamped image every place has the texel of the border, so a place there may be moved.
    """
    mesh = scene.mesh
    corners = mesh.faces[cut.triangle]
    level, periodic, size = texel_places(scene, cut.triangle, cut.level)
    # A span that is in the image at one end is not beyond these limits at the other.
    limits = np.where(periodic, np.inf, MOST_TEXELS + 1)
    weights = cut.weights_left, cut.weights_right
    nearness = tuple(of.sum(axis=1) for of in weights)
    ends = []
    for of, total in zip(weights, nearness, strict=True):
        share = of / total[:, np.newaxis]
        parts = []
        if albedo.colors:
            parts.append(np.clip(np.einsum("sn,snk->sk", share, mesh.given_colors[corners]), 0, 1))
        if albedo.texture is not None:
            places = np.einsum("sn,snk->sk", share, mesh.given_coordinates[corners]) * size
            parts.append(np.clip(places, -limits, size + limits))
        ends.append(np.concatenate(parts, axis=1))
    left, right = ends
    return SpanAttributes.quantise(
        albedo.spans,
        left,
        right,
        cut.length,
        weights=(nearness[0], nearness[1]) if albedo.perspective else None,
        level=level,
        periodic=periodic,
    )
