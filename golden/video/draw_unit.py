"""Draw unit: from a mesh in memory to the pixels of each band of a frame."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.triangle_frame import SPAN_ANGLE, triangle_constants
from blysk.golden.frames.vector_axes import triangle_axes
from blysk.golden.geometry.triangles import FrameSettings, Triangles
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.golden.render import DrawnPixels, Renderer
from blysk.golden.video.controls import Controls
from blysk.golden.video.draw_commands import COMMAND_BITS, KINDS, DrawCommands
from blysk.golden.video.memory_contents import MemoryContents
from blysk.golden.video.mesh_memory import MeshMemory
from blysk.golden.video.motion import Motion, rotation
from blysk.golden.video.triangle_assembly import TriangleAssembly
from blysk.golden.video.vertex_unit import ScreenVertices, VertexTransform

__all__ = ["BandPixels", "Drawing", "Room", "board_design", "turned"]

_SHORTER = 1 - 2.0**-11
"""Length of axes with several lights. So no normal is longer than 1 after the matrix's roundings."""


class Room(NamedTuple):
    """Words that the memories of a drawing have room for.

    Parameters
    ----------
    vertices, triangles : int
        Vertices and triangles of the mesh memory.
    commands : int
        Commands of each list.
    """

    vertices: int
    triangles: int
    commands: int


@dataclass(frozen=True)
class BandPixels:
    """Pixels of a band in the order of drawing.

    Parameters
    ----------
    band : int
        Index of the band, 0 at the top.
    x, y : int64 arrays, shape (P,)
        Column, and line of the band.
    color : uint8 array, shape (P, 3)
        Red, green, blue.
    counts : dict of str to int
        Counters of `TriangleAssembly` and of `Renderer`.
    """

    band: int
    x: np.ndarray
    y: np.ndarray
    color: np.ndarray
    counts: dict[str, int]


@dataclass(frozen=True)
class Drawing:
    """Bit-accurate model of drawing in bands: a mesh memory, its motion, lists of commands, a renderer.

    A frame's vertices are transformed once. For every band all triangles are read, clipped to the lines of
    the band, and shaded. Depth and colour of a pixel depend on its triangle alone. So the bands together are
    the picture of the whole frame, to the bit.

    Parameters
    ----------
    mesh : MeshMemory
        Vertices and triangles.
    motion : Motion
        Matrices: a slot for each part of the memory and each set of axes of normals.
    commands : DrawCommands
        Lists, one for each preset of ``controls``.
    presets : tuple of tuple of FrameConstants
        Constants that the lists write, for each preset and material.
    renderer : Renderer
        Renderer with a design whose ``x_bits`` and ``y_bits`` come from `place_bits`.
    size : (int, int)
        Width and height of the picture.
    frames : tuple of FrameSettings
        Settings of the whole picture for each preset. They differ, because a steeper highlight needs shorter
        spans.
    controls : Controls
        Angle and preset of each frame.
    lines : int
        Number of lines of a band.
    transform : VertexTransform
        Vertex unit.

    Raises
    ------
    ValueError
        If the design is made for another size, or the numbers of lists, presets and frames differ from the
        controls'. If a command goes past the end of the slots, the materials, the vertices or the triangles.
        If the mesh brings other attributes of the surface than the vertex unit and the renderer take, or
        texels are not fixed.

    Source: docs/theory/video.md#bands; [T] figure 4.10.
    """

    mesh: MeshMemory
    motion: Motion
    commands: DrawCommands
    presets: tuple[tuple[FrameConstants, ...], ...]
    renderer: Renderer
    size: tuple[int, int]
    frames: tuple[FrameSettings, ...]
    controls: Controls = field(default_factory=Controls)
    lines: int = 16
    transform: VertexTransform = field(default_factory=VertexTransform)

    def __post_init__(self) -> None:
        design, bits = self.renderer.design, self.place_bits(self.size, self.lines)
        if (design.x_bits, design.y_bits) != bits:
            raise ValueError(
                f"the design has {design.x_bits} and {design.y_bits} bits of a place, a band of "
                f"{self.size[0]}x{self.lines} has {bits[0]} and {bits[1]}"
            )
        taken = self.renderer.geometry.surface
        if not self.mesh.surface == self.transform.surface == taken:
            raise ValueError("the mesh brings other attributes of the surface than the design takes")
        albedo = design.albedo
        if albedo is not None and albedo.texture is not None and albedo.texture.memory.fixed is None:
            raise ValueError("the texels of a drawing must be fixed in the design")
        wanted = self.controls.materials * self.controls.lights
        if {len(self.commands.starts), len(self.presets), len(self.frames)} != {wanted}:
            raise ValueError(f"the controls choose from {wanted} lists, but there are {len(self.presets)}")
        self.commands.check("transform", index=self.motion.slots, range=self.mesh.vertices)
        self.commands.check("draw", index=design.materials, range=self.mesh.triangles)

    @staticmethod
    def place_bits(size: tuple[int, int], lines: int) -> tuple[int, int]:
        """Bits of a column and of a line of a band, ``x_bits`` and ``y_bits`` of the design."""
        return max((size[0] - 1).bit_length(), 1), max((lines - 1).bit_length(), 1)

    @classmethod
    def of(
        cls,
        scenes: Sequence[Scene],
        design: ShadingPipeline | None = None,
        *,
        lines: int = 16,
        axis: Sequence[float] = (0.0, 1.0, 0.0),
        controls: Controls | None = None,
        transform: VertexTransform | None = None,
        angle: float | None = None,
    ) -> "Drawing":
        """Drawing of a scene's mesh, which turns around its own middle.

        For a method that takes vectors the matrices turn normals into the frame of the scene's light. Scenes
        with the same frame share their matrices. The design needs the albedo path of the scenes, see
        `fixed_albedo_of`. All textures have level 0 only.

        Parameters
        ----------
        scenes : sequence of Scene
            The presets: scenes with the same mesh, camera and size, and different materials and lights.
        design : ShadingPipeline, optional
            Shading. Its ``x_bits`` and ``y_bits`` are replaced. By default `board_design` for the lights and
            materials of the scenes.
        lines : int
            Number of lines of a band.
        axis : three floats
            Axis of the rotation.
        controls : Controls, optional
            Buttons. By default every scene is a material of the controls.
        transform : VertexTransform, optional
            Vertex unit.
        angle : float, optional
            As for `sent_triangles`.

        Raises
        ------
        ValueError
            If a scene does not fit the design, the mesh the memory, or the camera the matrix. If triangles do
            not serve the design, see `Renderer`. If a texture has several levels, or its coordinates do not
            fit, see `MeshMemory.of`.
        """
        scene, transform = scenes[0], transform or VertexTransform()
        design = design or board_design(max(len(each.lights) for each in scenes), len(scene.materials))
        size = scene.width, scene.height
        x_bits, y_bits = cls.place_bits(size, lines)
        design = replace(design, x_bits=x_bits, y_bits=y_bits)
        if any(texture.mipmapped for texture in scene.textures.values()):
            raise ValueError("a mesh in memory takes level 0 of a texture; leave out the other levels")
        renderer = Renderer(design)
        surface = renderer.geometry.surface
        mesh = MeshMemory.of([scene.mesh], surface, scene.textures)
        transform = replace(transform, surface=surface)
        given = [triangle_axes(each, design) for each in scenes]
        turned_to = [np.eye(3) if axes is None else axes for axes in given]
        axes, sets = np.unique(np.stack(turned_to), axis=0, return_inverse=True)
        if renderer.rows:
            axes = axes * _SHORTER
        presets = tuple(tuple(triangle_constants(each, renderer)) for each in scenes)
        widest = FrameSettings.limit_of(SPAN_ANGLE if angle is None else angle)
        return cls(
            mesh=mesh,
            motion=Motion.of(mesh, scene.camera, size, axis, transform, list(axes)),
            commands=DrawCommands.of(mesh, presets, sets=sets.ravel().tolist()),
            presets=presets,
            renderer=renderer,
            size=size,
            frames=tuple(
                FrameSettings.centred(*size, back_faces=scene.back_faces, limit=widest) for _ in scenes
            ),
            controls=controls or Controls(materials=len(scenes)),
            lines=lines,
            transform=transform,
        )

    @property
    def room(self) -> Room:
        """The largest room in as many block RAMs as the memories take. Padded to it, a drawing keeps it."""
        return Room(*self.mesh.largest_room(self.assembly.screen_bits), self.commands.room)

    def padded(self, room: Room) -> "Drawing":
        """The same drawing with memories of a given room.

        Two padded drawings of the same design, with the same room, background and treatment of back faces,
        differ in nothing but the words of memories. Each takes as many matrices as a block RAM holds.

        Raises
        ------
        ValueError
            If the room is too small.
        """
        return replace(
            self,
            mesh=replace(self.mesh, room=(room.vertices, room.triangles)),
            motion=self.motion.padded(Motion.ROOM),
            commands=self.commands.padded(room.commands),
        )

    @property
    def bands(self) -> int:
        """Number of bands."""
        return -(-self.size[1] // self.lines)

    @property
    def memories(self) -> tuple[MemoryContents, ...]:
        """The memories that hold the mesh, its motion, and what it is drawn with.

        Constants of the frame are in the commands. The coefficients are those of the matrices.
        """
        mesh, commands, rows = self.mesh, self.commands.codes, self.motion.words
        return (
            MemoryContents("vertices", mesh.vertex_bits, mesh.vertex_room, tuple(mesh.vertex_words)),
            MemoryContents("triangles", 3 * mesh.index_bits, mesh.triangle_room, tuple(mesh.triangle_words)),
            MemoryContents("commands", COMMAND_BITS, len(commands), tuple(commands)),
            MemoryContents("coefficients", self.motion.WORD_BITS, len(rows), tuple(rows)),
        )

    @property
    def assembly(self) -> TriangleAssembly:
        """Bit-accurate model of the triangle assembly."""
        return TriangleAssembly(self.mesh, self.transform.grid)

    def rows(self, band: int, preset: int = 0) -> FrameSettings:
        """The frame, clipped to the lines of a band."""
        frame = self.frames[preset]
        top = frame.top + band * self.lines
        return replace(frame, top=top, bottom=min(top + self.lines, frame.bottom))

    def vertices(self, angle: int, preset: int = 0) -> ScreenVertices:
        """All vertices on the screen, at the code of an angle, by the matrices of a list."""
        words = self.commands.compute(self.commands.starts[preset], True)
        transforms = words[words[:, 0] == KINDS.index("transform")]
        given = self.mesh.attributes
        # A part that the list does not transform is not drawn.
        slots = dict(zip(transforms[:, 2].tolist(), transforms[:, 1].tolist(), strict=True))
        made = [
            self.transform.compute(
                self.mesh.position[part.first : part.first + part.count],
                self.mesh.normal[part.first : part.first + part.count],
                self.motion.matrix(slots.get(part.first, 0), angle),
                None if given is None else given[part.first : part.first + part.count],
            )
            for part in self.mesh.parts
        ]
        parts = [part.beats for part in made]
        return ScreenVertices(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})

    def triangles(self, angle: int, preset: int, rows: FrameSettings) -> tuple[Triangles, dict[str, int]]:
        """Triangles of some scanlines, and the counters of the assembly."""
        words = self.commands.compute(self.commands.starts[preset], True)
        draws = words[words[:, 0] == KINDS.index("draw")]
        return self.assembly.compute(
            self.vertices(angle, preset), draws[:, 2], draws[:, 3], draws[:, 1], rows.top, rows.bottom
        )

    def band(self, band: int, angle: int, preset: int = 0) -> BandPixels:
        """Bit-accurate pixels of a band.

        Parameters
        ----------
        band : int
            Index of the band.
        angle : int
            Code of the angle.
        preset : int
            Index of the list.
        """
        rows = self.rows(band, preset)
        triangles, counts = self.triangles(angle, preset, rows)
        drawn = self.renderer.compute(triangles, rows, self.presets[preset])
        return BandPixels(band, drawn.x, drawn.y, drawn.color, counts | drawn.counts)

    def whole(self, angle: int, preset: int = 0) -> DrawnPixels:
        """Pixels of the same triangles from a renderer of whole frames."""
        design = self.renderer.design
        y_bits = max((self.size[1] - 1).bit_length(), 1)
        renderer = Renderer(replace(design, y_bits=y_bits), self.renderer.geometry)
        triangles, _ = self.triangles(angle, preset, self.frames[preset])
        return renderer.compute(triangles, self.frames[preset], self.presets[preset])

    def picture(self, angle: int, preset: int = 0, background: Sequence[int] = (0, 0, 0)) -> np.ndarray:
        """Frame buffer of all bands, uint8, shape (height, width, 3)."""
        image = np.empty((self.size[1], self.size[0], 3), dtype=np.uint8)
        image[...] = background
        for index in range(self.bands):
            pixels = self.band(index, angle, preset)
            image[index * self.lines + pixels.y, pixels.x] = pixels.color
        return image


def board_design(lights: int = 1, materials: int = 1) -> ShadingPipeline:
    """The shading pipeline of the boards: quotient, blinn.

    Parameters
    ----------
    lights, materials : int
        As for `ShadingPipeline`.
    """
    return preset("quotient", "blinn", lights, materials=materials)


def turned(scene: Scene, angle: int, axis: Sequence[float] = (0.0, 1.0, 0.0)) -> Scene:
    """The scene with its mesh turned by the code of an angle, in float64, as the frame should show it."""
    mesh = scene.mesh
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    turn = rotation(axis, Motion.radians(angle))
    vertices = (mesh.vertices - centre) @ turn.T + centre
    return replace(scene, mesh=replace(mesh, vertices=vertices, normals=mesh.normals @ turn.T))
