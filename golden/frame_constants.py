"""Frame constants: the words that a pipeline gets before a frame, and their addresses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import LoadedTextures, TextureDescriptor
from blysk.golden.lighting.intensity import MAX_INTENSITY, MAX_LIGHTS, Intensity
from blysk.golden.lighting.lobe import LobeTable
from blysk.golden.number.fixed import Format
from blysk.golden.number.unit_vector import quantise
from blysk.golden.reference.lighting import distant_cosine, halfway_vector
from blysk.golden.reference.reflection import ReflectionModel
from blysk.golden.reference.scene import Scene

__all__ = [
    "AXES_ADDRESS",
    "AXIS_STRIDE",
    "BANK_ADDRESS",
    "EMISSION_ADDRESS",
    "FIELDS_OF_A_FRAME",
    "FIELDS_OF_A_LIGHT",
    "LIGHT_STRIDE",
    "LOBE_ADDRESS",
    "MATERIAL_ADDRESS",
    "MAX_MATERIALS",
    "NOT_READ",
    "TEXELS_ADDRESS",
    "TEXEL_ADDRESS",
    "TEXTURE_ADDRESS",
    "THRESHOLD_ADDRESS",
    "TINTED_ADDRESS",
    "UNIT_VECTORS",
    "FrameConstants",
    "LightMeanings",
    "address_table",
    "by_material",
    "writes_of",
]

FIELDS_OF_A_FRAME = {"exponent": (0, 1), "ambient": (1, 3)}
"""First address and number of words of each field that a frame has once."""

EMISSION_ADDRESS = 8
"""First address of the emission, red green blue, in a pipeline with an albedo."""

TINTED_ADDRESS = 11
"""Address that tells whether a material is tinted, in a pipeline with tints."""

TEXTURE_ADDRESS = 12
"""First of two addresses of a material's texture, in a pipeline with textures: `TextureDescriptor.words`."""

TEXELS_ADDRESS, TEXEL_ADDRESS = 14, 15
"""Addresses that load texels: one takes an index, the other takes values, see `LoadedTextures.writes`."""

FIELDS_OF_A_LIGHT = {"direction": (0, 3), "halfway": (3, 3), "diffuse": (6, 3), "specular": (9, 3)}
"""First address and number of words for each field of a light. Add ``(light + 1) * LIGHT_STRIDE``."""

MATERIAL_ADDRESS = 4
"""Address of the index of a material, in a pipeline with several. Later constants belong to this material."""

LOBE_ADDRESS = 5
"""Address that loads tables of lobes, see `LobeTable.writes`; bit 17 of the data is ``begins``."""

THRESHOLD_ADDRESS = 6
"""Address of a material's threshold, see `ShadingPipeline.threshold_of`, in a pipeline that loads tables."""

BANK_ADDRESS = 7
"""Address of the bank of a material's table, in a pipeline with several banks."""

AXES_ADDRESS = 256
"""First address of the axes of further lights' frames, `LIGHT_STRIDE` addresses a light.

Hardware turns vectors from the frame of the first light into these frames, see `LightAdapter`.
"""

AXIS_STRIDE = 4
"""Addresses from an axis of a light to the next."""

MAX_MATERIALS = 1024
"""Largest number of materials of a pipeline."""

LIGHT_STRIDE = 16
"""Addresses from one light to the next."""


_WIDER: dict[str | None, str] = {
    "exponent": "lower the exponent,",
    "roughness": "raise the roughness or lower",
}


@dataclass(frozen=True)
class FrameConstants:
    """Codes of the constants of a frame.

    Parameters
    ----------
    exponent : int
        Specular exponent, 1 to 1000; a pipeline with tables of lobes does not read it.
    ambient : int array, shape (3,)
        Ambient colour operand, ``UQ(11, 6)`` in LSB.
    direction, halfway : int arrays, shape (lights, 3)
        Unit vectors of each light, ``SQ(1, 17)``: L to the light, and H half-way to the viewer.
    diffuse, specular : int arrays, shape (lights, 3)
        Colour operands of each light, ``UQ(11, 6)`` in LSB.
    lobe : LobeTable, optional
        Table of the lobe, for a design whose specular unit has tables; see `prepare.constants_of`.
    bank : int
        Bank of this table.
    threshold : int, optional
        Threshold of this table, see `ShadingPipeline.threshold_of`, for a design with a gate.
    axes : int array, shape (lights - 1, rows, 3), optional
        Axes of the frame of each further light, in the frame of the first light, ``SQ(1, 17)``. The rows are
        x, y, z. With highlights of R·V they are x, ``y cos a``, z. Without highlights there is z alone. For a
        renderer of triangles whose method takes vectors.
    emission : int array, shape (3,), optional
        Emission, ``UQ(11, 6)`` in LSB, for a design with an albedo.
    tinted : bool, optional
        Whether the material is tinted, for a design with tints.
    texture : TextureDescriptor, optional
        Texture of the material, for a design with textures.
    texels : LoadedTextures, optional
        Contents of the texel memory, if texels are written. Only the constants of the first material have
        them.
    """

    exponent: int
    ambient: np.ndarray
    direction: np.ndarray
    halfway: np.ndarray
    diffuse: np.ndarray
    specular: np.ndarray
    lobe: LobeTable | None = None
    bank: int = 0
    threshold: int | None = None
    axes: np.ndarray | None = None
    emission: np.ndarray | None = None
    tinted: bool | None = None
    texture: TextureDescriptor | None = None
    texels: LoadedTextures | None = None

    @property
    def table(self) -> LobeTable:
        """Table of the lobe.

        Raises
        ------
        ValueError
            If the constants have no table.
        """
        if self.lobe is None:
            raise ValueError("a lobe needs a table; constants_of gives a scene's constants their tables")
        return self.lobe

    @property
    def highlight(self) -> int | LobeTable:
        """Parameter of the specular unit: the exponent, or the table."""
        return self.exponent if self.lobe is None else self.lobe

    @classmethod
    def of(
        cls,
        scene: Scene,
        lights: int | None = None,
        energy: ReflectionModel | None = None,
        index: int = 0,
        mirror: bool = False,
    ) -> "FrameConstants":
        """Constants of a scene and one of its materials, for a pipeline with ``lights`` lights.

        - Lights that the scene does not have are black.
        - A light straight behind the surface that faces the viewer (``L = -V``) has no half-way vector. It
          has specular light only by R·V.
        - With point lights or a near viewer L and H change within a frame. Then both are 0 here.
        - A light that is off has vectors and colours of 0. So its terms are 0, and the compact style spends
          no cycle on them.
        - Fresnel's reflection of a distant light and viewer is a constant, and part of the specular colour.
        - A material that is unlit has its k_d as ambient colour. Its diffuse and specular colours are 0.
        - In a scene without albedo the emission is part of the ambient colour.

        With ``energy`` the highlight has the energy-normalised form: `ReflectionModel.energy_factor`
        multiplies k_s here, once a frame. The specular unit stays as it is. The factor multiplies the unit's
        error, too. A colour operand holds ``k_s I_i`` times the factor up to 8. With ``k_s I_i = 1`` this
        allows exponents up to 48 (``phong``), 195 (``blinn``) and 36 (``cosquad_lin``). Higher exponents need
        a darker k_s.

        Parameters
        ----------
        scene : Scene
            Material, lights and viewer.
        lights : int, optional
            Lights of the pipeline; by default as many as the scene has, at least 1.
        energy : ReflectionModel, optional
            Model that has an energy factor. For an approximation of Blinn's power, Blinn's model may be
            given.
        index : int
            Index of the material.
        mirror : bool
            Whether the highlight is of R·V.

        Raises
        ------
        ValueError
            If the scene has more lights than the pipeline, a term is brighter than 8, or there is no factor
            for the model.

        Notes
        -----
        Source of the factors: [C].
        """
        material = scene.materials[index]
        factor = 1.0 if energy is None else energy.energy_factor(material.parameter(energy))
        count = max(len(scene.lights), 1) if lights is None else lights
        if not len(scene.lights) <= count <= MAX_LIGHTS:
            raise ValueError(f"the pipeline has {count} lights, the scene {len(scene.lights)}")
        direction = np.zeros((count, 3), dtype=np.int64)
        halfway, diffuse, specular = np.zeros((3, count, 3), dtype=np.int64)
        for index, light in enumerate(scene.lights):
            if not light.is_on:
                continue
            between = np.zeros(3)
            if light.direction is not None and not scene.local:
                direction[index] = quantise(np.asarray(light.direction))
                between = halfway_vector(light.direction, scene.camera.viewer)
            has_halfway = np.any(between)
            if has_halfway:
                halfway[index] = quantise(between)
            # Materials share the vectors, not the colours.
            if material.unlit:
                continue
            diffuse[index] = Intensity.color(np.multiply(material.diffuse, light.color))
            if scene.local or has_halfway or mirror:
                reflection = material.reflection(distant_cosine(light, scene.distant_viewer))
                highlight = factor * reflection * light.color
                if energy is not None and highlight.max() > MAX_INTENSITY:
                    raise ValueError(
                        f"the energy factor {factor:.4g} of {energy.name} with {energy.PARAMETER} "
                        f"{material.parameter(energy)} makes a specular term of {highlight.max():.4g}, over "
                        f"{MAX_INTENSITY}; {_WIDER[energy.PARAMETER]} the specular coefficient or the light"
                    )
                specular[index] = Intensity.color(highlight)
        ambient = material.ambient_term(scene.ambient_light)
        if not scene.has_albedo:
            ambient = ambient + material.emission
        return cls(material.exponent, Intensity.color(ambient), direction, halfway, diffuse, specular)

    def writes(self, index: int | None = None, loads: bool = True) -> dict[str, np.ndarray]:
        """Beats for the write port: ``address`` and ``data``, 18 bits of each code.

        Parameters
        ----------
        index : int, optional
            Index of the material, for a pipeline with several.
        loads : bool
            Whether the table of a lobe is loaded, unless it is fixed at build time.
        """
        address, data = ([], []) if index is None else ([MATERIAL_ADDRESS], [index])
        for name, (first, count) in FIELDS_OF_A_FRAME.items():
            address += range(first, first + count)
            data += np.ravel(getattr(self, name)).tolist()
        if self.lobe is not None and self.lobe.lobe.banks > 1:
            address.append(BANK_ADDRESS)
            data.append(self.bank)
        if self.threshold is not None:
            address.append(THRESHOLD_ADDRESS)
            data.append(self.threshold)
        if self.lobe is not None and self.lobe.lobe.fixed is None and loads:
            beats = self.lobe.writes(self.bank)
            address += [LOBE_ADDRESS] * len(beats["value"])
            data += (beats["value"] | beats["begins"] << 17).tolist()
        for first, words in self._albedo_words:
            address += range(first, first + len(words))
            data += words
        if self.texels is not None:
            beats = self.texels.writes()
            address += np.where(beats["begins"], TEXELS_ADDRESS, TEXEL_ADDRESS).tolist()
            data += beats["value"].tolist()
        for light in range(len(self.direction)):
            base = (light + 1) * LIGHT_STRIDE
            for name, (first, count) in FIELDS_OF_A_LIGHT.items():
                address += range(base + first, base + first + count)
                data += getattr(self, name)[light].tolist()
        for light, rows in enumerate(() if self.axes is None else self.axes, 1):
            base = AXES_ADDRESS + light * LIGHT_STRIDE
            address += [base + AXIS_STRIDE * row + k for row in range(len(rows)) for k in range(3)]
            data += np.ravel(rows).tolist()
        return {"address": np.array(address), "data": np.array(data) & 0x3FFFF}

    @property
    def _albedo_words(self) -> list[tuple[int, list[int]]]:
        """First address and words of each constant of a design with an albedo."""
        found: list[tuple[int, list[int]]] = []
        if self.emission is not None:
            found.append((EMISSION_ADDRESS, self.emission.tolist()))
        if self.tinted is not None:
            found.append((TINTED_ADDRESS, [int(self.tinted)]))
        if self.texture is not None:
            found.append((TEXTURE_ADDRESS, list(self.texture.words)))
        return found


def writes_of(constants: Sequence[FrameConstants]) -> dict[str, np.ndarray]:
    """Beats for the write port, from the constants of each material; see `FrameConstants.writes`.

    A table that several materials share is loaded once.
    """
    if len(constants) == 1:
        return constants[0].writes()
    banks = [of_material.bank for of_material in constants]
    writes = [of.writes(index, banks.index(of.bank) == index) for index, of in enumerate(constants)]
    return {name: np.concatenate([beats[name] for beats in writes]) for name in ("address", "data")}


_MEANINGS = {
    "exponent": "specular exponent, 1 to 1000; for a lobe the exponent of an equally steep Blinn's power",
    "ambient": "ambient colour, red green blue, UQ(11, 6) in LSB of the channel",
    "material": "index of the material to which the next exponent and colours belong",
    "lobe": "next value of a table, UQ(0, 17); with bit 17 set, number of the bank whose table begins",
    "threshold": "of the table: where its highlight ends; {threshold}",
    "bank": "bank of the material's table",
    "emission": "emission of the material, red green blue, UQ(11, 6)",
    "tinted": "1: the albedo multiplies the specular sum of the material, too",
    "texture": "texture of the material: sizes, wrap and filter; base",
    "texels": "index from which the texels written next begin, in pairs of words",
    "texel": "next half of a word of texels",
    "diffuse": "diffuse colour, red green blue, UQ(11, 6)",
    "specular": "specular colour, red green blue, UQ(11, 6)",
}


class LightMeanings(NamedTuple):
    """Texts for the vectors of a light, in the tables of frame constants.

    Parameters
    ----------
    direction, halfway : str
        Meaning of L and of H.
    one : str
        The code that stands for 1, as a text.
    """

    direction: str
    halfway: str
    one: str = "2^17 - 1"

    @property
    def texts(self) -> dict[str, str]:
        """Meanings by the names of the fields."""
        return {"direction": self.direction, "halfway": self.halfway}


UNIT_VECTORS = LightMeanings("unit vector to the light", "unit half-way vector")
"""Meanings for methods of normals."""

NOT_READ = LightMeanings("not read", "not read")
"""Meanings for methods that read no vector of a light."""


def by_material(constants: FrameConstants | Sequence[FrameConstants]) -> list[FrameConstants]:
    """Constants as a sequence, one for each material. A single `FrameConstants` is of the only material."""
    return [constants] if isinstance(constants, FrameConstants) else list(constants)


def address_table(
    lights: int,
    materials: int = 1,
    banks: int = 0,
    threshold: Format | None = None,
    loads_tables: bool = False,
    of_a_light: LightMeanings = UNIT_VECTORS,
    axes: Sequence[str] = (),
    albedo: Albedo | None = None,
) -> list[str]:
    """Lines of text with the address and format of every frame constant of a pipeline.

    Parameters
    ----------
    lights, materials : int
        Numbers of lights and materials.
    banks : int
        Number of tables of lobes.
    threshold : Format or None
        Format of the threshold of each table; ``None``: tables have none.
    loads_tables : bool
        Whether tables are loaded.
    of_a_light : LightMeanings
        Texts for L and H, see `Interpolator.light_meanings`.
    axes : sequence of str
        Names of the axes that each further light has, see `FrameConstants.axes`.
    albedo : Albedo or None
        Albedo path of the design.
    """
    vectors = {name: f"{text}, SQ(1, 17)" for name, text in of_a_light.texts.items()}
    meanings = _MEANINGS | vectors
    rows = [(first, count, name) for name, (first, count) in FIELDS_OF_A_FRAME.items()]
    if materials > 1:
        rows.append((MATERIAL_ADDRESS, 1, "material"))
    if loads_tables:
        rows.append((LOBE_ADDRESS, 1, "lobe"))
    if banks > 1:
        rows.append((BANK_ADDRESS, 1, "bank"))
    if threshold is not None:
        rows.append((THRESHOLD_ADDRESS, 1, "threshold"))
    if albedo is not None:
        rows.append((EMISSION_ADDRESS, 3, "emission"))
        if albedo.tints:
            rows.append((TINTED_ADDRESS, 1, "tinted"))
        if albedo.texture is not None:
            rows.append((TEXTURE_ADDRESS, 2, "texture"))
            if albedo.texture.memory.fixed is None:
                rows += [(TEXELS_ADDRESS, 1, "texels"), (TEXEL_ADDRESS, 1, "texel")]
    for light in range(lights):
        base = (light + 1) * LIGHT_STRIDE
        rows += [(base + first, count, name) for name, (first, count) in FIELDS_OF_A_LIGHT.items()]
    meanings |= {axis: f"{axis} in the frame of light 0, SQ(1, 17)" for axis in axes}
    for light in range(1, lights):
        base = AXES_ADDRESS + light * LIGHT_STRIDE
        rows += [(base + AXIS_STRIDE * row, 3, axis) for row, axis in enumerate(axes)]
    lines = []
    for first, count, name in rows:
        end = f" to {first + count - 1}" if count > 1 else ""
        number = first // LIGHT_STRIDE - (1 if first < AXES_ADDRESS else AXES_ADDRESS // LIGHT_STRIDE)
        whose = f" (light {number})" if first >= LIGHT_STRIDE else ""
        lines.append(f"  {first:>3}{end:<8} {meanings[name].format(threshold=threshold)}{whose}")
    return lines
