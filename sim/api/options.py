"""Every option of scenes and designs: its type, default, help text and key in a scene file."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypedDict, Union, get_args

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.build import (
    ATTRIBUTES,
    LANES,
    MEMORIES,
    PIPES,
    PORTS,
    SETUPS,
    STREAMS,
    STYLES,
    TOPS,
    Style,
)
from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.methods.interpolator import Operand
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.presets import METHODS, PUBLISHED
from blysk.golden.reference.camera import PROJECTIONS
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.light import Triple
from blysk.golden.reference.lobes import TabulatedModel
from blysk.golden.reference.scene import BACK_FACES, VIEWERS
from blysk.golden.reference.transfer import TRANSFERS
from blysk.sim.api.lights import Lights, LightsLike
from blysk.sim.api.option_types import Direction, ReflectionOption, Roughness
from blysk.sim.meshes.normals import DEFAULT_CREASE
from blysk.sim.meshes.teapot import DEFAULT_TRIANGLES, MAX_TRIANGLES, MIN_TRIANGLES
from blysk.sim.value_types import (
    Choice,
    Color,
    Few,
    Number,
    Several,
    Size,
    Truth,
    Value,
    Vector,
    Whole,
)

if TYPE_CHECKING:
    import trimesh

__all__ = [
    "BUILD",
    "COEFFICIENTS",
    "DESIGN",
    "DOCUMENTS",
    "GEOMETRIES",
    "LIGHTS",
    "MAX_FRAMES",
    "NEEDS",
    "RENDERING",
    "SCENE",
    "SLOW_SIZE",
    "VIEW_WORDS",
    "BuildOptions",
    "ColorLike",
    "DesignOptions",
    "Engine",
    "Option",
    "RenderOptions",
    "SceneOptions",
    "Source",
]

SLOW_SIZE = (160, 120)
"""Largest width and height where pysim replaces cxxrtl, and default size of pictures with waveforms."""

MAX_FRAMES = 9999
"""Largest number of frames of a turntable. Their file names have four digits."""

COEFFICIENTS = ("ambient", "diffuse", "specular", "exponent", "roughness", "fresnel")
"""Options of a material."""

ColorLike = str | float | Triple
"""A colour: ``"#rrggbb"`` in sRGB, or one number or three of linear light."""

Source = Union[str, os.PathLike[str], Mesh, Sequence[Any], "trimesh.Trimesh", "trimesh.Scene"]
"""``"teapot"``, the name of a mesh file or scene file, a `Mesh`, a mesh or scene of trimesh, or arrays of
vertices, faces and, if known, normals."""

Engine = Literal["auto", "cxxrtl", "pysim"]
"""Names of engines. ``"auto"`` takes ``"cxxrtl"``, or ``"pysim"`` if no C++ compiler works."""

DOCUMENTS = (".md", ".h", ".svd")
"""Suffixes of the documents that are written beside the Verilog of a core on a bus."""

GEOMETRIES = ("software", "hardware")
"""Choices of the option ``geometry``: the part that turns triangles into spans."""


class Option(NamedTuple):
    """An option of the command line, of Python and of scene files.

    Parameters
    ----------
    kind : Value
        Its type.
    default : object
        The option's value if neither the caller nor a scene file gives a value.
    help : str
        Text of the command line's help.
    key : str
        Its key in a scene file. Empty if scene files do not have the option.
    """

    kind: Value
    default: Any
    help: str
    key: str = ""


LIGHTS = ("lights", "point_lights", "spot_lights")
"""Options of lights. A scene has the lights of all options, in this order of the options."""

VIEW_WORDS = ("front", "back", "left", "right", "top", "bottom")
_UP_WORDS: dict[str, str | Triple] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

SCENE: dict[str, Option] = {
    "size": Option(Size(), (640, 480), "Size of the picture.", "size"),
    "background": Option(
        Color(),
        "#1a1c20",
        "Colour of the pixels that show no surface. A colour is #rrggbb in sRGB, or three numbers or a "
        "number of linear light.",
        "background",
    ),
    "ambient_light": Option(Color(8), 1.0, "Intensity I_a of the ambient light.", "ambient_light"),
    "back_faces": Option(
        Choice("treatment of back faces", BACK_FACES),
        "flip",
        "Back faces. flip turns their normals, show keeps their normals, cull leaves the faces out.",
        "back_faces",
    ),
    "triangles": Option(
        Whole(MIN_TRIANGLES, MAX_TRIANGLES),
        DEFAULT_TRIANGLES,
        "Approximate number of triangles of the teapot.",
        "mesh.triangles",
    ),
    "crease": Option(
        Number(0, 180, "degrees"),
        DEFAULT_CREASE,
        "In a mesh without normals, an edge is sharp if the normals of its faces differ by more than this "
        "angle, in degrees.",
        "mesh.crease",
    ),
    "materials": Option(
        Choice("source of materials", ("file", "one")),
        "file",
        "file: materials of the mesh file; options replace their values. one: one material, made from "
        "options alone.",
        "mesh.materials",
    ),
    "projection": Option(
        Choice("projection", PROJECTIONS), "perspective", "Projection of the camera.", "camera.projection"
    ),
    "view": Option(
        Direction({word: word for word in VIEW_WORDS}),
        (0.4, 0.5, 1.0),
        "Direction from the mesh to the viewer. The camera shows the whole mesh. The directions of the words "
        "and the default direction turn with --up. Options of the camera replace the camera of a file.",
        "camera.view",
    ),
    "position": Option(
        Vector("three numbers"),
        None,
        "Position of the camera in the mesh's units; replaces --view.",
        "camera.position",
    ),
    "target": Option(
        Vector("three numbers"),
        None,
        "With --position: the point in the middle of the picture.  [default: the middle of the mesh]",
        "camera.target",
    ),
    "up": Option(
        Direction(_UP_WORDS),
        (0.0, 1.0, 0.0),
        "Direction that points up in the picture. Most STL files and files of CAD programs need z.",
        "camera.up",
    ),
    "field_of_view": Option(
        Number(1, 179, "degrees"), 30.0, "Vertical angle of view, degrees.", "camera.field_of_view"
    ),
    "viewer": Option(
        Choice("viewer", VIEWERS),
        "distant",
        "distant: the viewer has the same direction for all points. near: the viewer is at the camera; needs "
        "--method chord-local.",
        "camera.viewer",
    ),
    "lights": Option(
        Lights(
            Vector("three or six numbers", (3, 6), "X,Y,Z or X,Y,Z,R,G,B"),
            ("direction", "color"),
            "give a direction other than 0 and colours of 0 or more",
        ),
        (-0.5, 0.8, 0.7),
        "Direction to a light, and its colour (1,1,1 if left out). Replaces the lights of a file.",
        "lights",
    ),
    "point_lights": Option(
        Lights(
            Vector("three, six or nine numbers", (3, 6, 9), "X,Y,Z or X,Y,Z,R,G,B or X,Y,Z,R,G,B,K0,K1,K2"),
            ("position", "color", "attenuation"),
            "give colours and coefficients of 0 or more",
        ),
        None,
        "Position of a light in the mesh's units, its colour, and its attenuation. At distance d the light "
        "is multiplied by 1/(K0 + K1 d + K2 d^2), limited to 1. Needs --method chord-local.",
    ),
    "spot_lights": Option(
        Lights(
            Vector(
                "eight, eleven or fourteen numbers",
                (8, 11, 14),
                "X,Y,Z,DX,DY,DZ,INNER,OUTER or ...,R,G,B or ...,R,G,B,K0,K1,K2",
            ),
            ("position", "spot", "cone", "color", "attenuation"),
            "give an axis other than 0, a larger outer angle, colours and coefficients of 0 or more",
        ),
        None,
        "Point light that shines along DX,DY,DZ: full light up to INNER degrees from this direction, none "
        "beyond OUTER degrees.",
    ),
    "ambient": Option(Color(), (0.08, 0.05, 0.03), "Ambient reflection k_a.", "material.ambient"),
    "diffuse": Option(Color(), (0.75, 0.42, 0.2), "Diffuse reflection k_d.", "material.diffuse"),
    "specular": Option(Color(), 0.6, "Specular reflection k_s.", "material.specular"),
    "exponent": Option(Whole(1, MAX_EXPONENT), 50, "Exponent of the highlight.", "material.exponent"),
    "roughness": Option(
        Roughness(),
        None,
        "Roughness as in glTF, for models without an exponent.  [default: from the exponent]",
        "material.roughness",
    ),
    "fresnel": Option(
        Color(),
        None,
        "Reflection F_0 along the normal. Schlick's F_0 + (1 - F_0)(1 - V.H)^5 then multiplies k_s.  "
        "[default: none]",
        "material.fresnel",
    ),
}
"""Options of a scene."""

DESIGN: dict[str, Option] = {
    "method": Option(
        Choice("method", METHODS | PUBLISHED),
        None,
        "Method of interpolation along a span.  [default: quotient; point lights, near viewer: chord-local; "
        "--gate: quadratic; --operand, --setup-interval, or a model without a table: renormalise]",
        "pipeline.method",
    ),
    "model": Option(
        ReflectionOption(),
        "blinn",
        "Reflection model. The method quotient serves all models; other methods serve all but phong. "
        "measured:NAME: a fit of docs/theory/measured.md. FILE.csv: points of a curve over N.H.",
        "pipeline.model",
    ),
    "operand": Option(
        Choice("operand", get_args(Operand)),
        None,
        "Operand of the specular unit, for methods that compute normals.  [default: the method's own]",
        "pipeline.operand",
    ),
    "gate": Option(
        Truth(),
        False,
        "Build a highlight gate: spans without a highlight bypass the specular units.",
        "pipeline.gate",
    ),
    "setup_interval": Option(
        Whole(1, 46),
        None,
        "Minimum cycles from one span to the next. A shorter interval takes more multipliers.  "
        "[default: 3 or 4, depending on the method; compact: the longest]",
        "pipeline.setup_interval",
    ),
    "style": Option(
        Choice("style", STYLES),
        "throughput",
        "throughput: one pixel a cycle. compact: few multipliers.",
        "pipeline.style",
    ),
    "transfer": Option(
        Choice("transfer", TRANSFERS),
        "srgb",
        "Codes of the pixels. srgb: encoded by the curve of sRGB, as monitors expect. linear: linear light.",
        "pipeline.transfer",
    ),
}
"""Options of a design, without its counts; ``setup_interval`` and ``style`` are fields of `Build`."""

NEEDS: dict[str, Option] = {
    "lights": Option(Whole(1, MAX_LIGHTS), 1, "Number of lights."),
    "materials": Option(
        Whole(1, MAX_MATERIALS), 1, "Number of materials. All materials share up to 64 lobe tables."
    ),
    "factors": Option(
        Whole(0, MAX_LIGHTS),
        0,
        "Number of lights that fade, by distance or as spots. They are the first lights. Needs --method "
        "chord-local.",
    ),
    "albedo": Option(
        Several("part", Albedo.PARTS),
        None,
        f"Colours of pixels. {' '.join(f'{word}: {text}.' for word, text in Albedo.PARTS.items())}  "
        "[default: none]",
    ),
    "grey": Option(
        Truth(), False, "Build one channel in place of three. It reads the colour constants of red."
    ),
    "x_bits": Option(
        Whole(1, LENGTH_BITS), LENGTH_BITS, "Bits of a column: pictures of at most 2^N columns."
    ),
    "y_bits": Option(Whole(1, LENGTH_BITS), LENGTH_BITS, "Bits of a row: pictures of at most 2^N rows."),
    "length_bits": Option(
        Whole(2, LENGTH_BITS), LENGTH_BITS, "Bits of the length of a span: at most 2^N - 1 pixels."
    ),
}
"""Parts of a design that a scene decides, for commands without a scene."""

BUILD: dict[str, Option] = {
    "geometry": Option(
        Choice("geometry", GEOMETRIES),
        "software",
        "Where triangles become spans: in software, or in the geometry RTL, which also tests depths.",
        "pipeline.geometry",
    ),
    "lanes": Option(
        Few(*LANES),
        1,
        "Number of lanes of the pipeline: pixels of a span in a beat. Needs the method quotient and the "
        "throughput style.",
        "pipeline.lanes",
    ),
    "pipes": Option(
        Few(*PIPES),
        1,
        "Number of pipelines, N. Pipeline k shades the scanlines with y mod N = k.",
        "pipeline.pipes",
    ),
    "merged": Option(
        Truth(), False, "With --pipes: merge all pixels into a stream, in the order of the spans."
    ),
    "top": Option(
        Choice("core", TOPS),
        None,
        "shader: spans to pixels. geometry: triangles to spans. render: triangles to pixels.  [default: "
        "shader; with --geometry hardware: render]",
    ),
    "bus": Option(
        Choice("bus", PORTS),
        "native",
        "Ports of the core. native: its own streams. axi, wishbone: AXI4-Stream, with registers on AXI4-Lite "
        "or Wishbone; -o X.v then also writes X.md, X.h and X.svd.",
    ),
    "stream": Option(
        Few(*STREAMS),
        None,
        "With --bus: bits of a beat of both AXI4-Streams.  [default: a whole triangle, span or pixel]",
    ),
    "setups": Option(
        Few(*SETUPS),
        1,
        "Lanes of triangle setup in hardware geometry. N lanes take small triangles N times as fast.",
        "pipeline.setups",
    ),
    "coarse": Option(
        Size(),
        None,
        "Build a coarse depth test for pictures of at most this size. The test drops hidden spans before "
        "shading. Needs a core from triangles to pixels.",
    ),
    "memories": Option(
        Choice("kind of memories", MEMORIES),
        "asynchronous",
        "synchronous: memories are read at a clock edge, for FPGAs without memories in look-up tables "
        "(iCE40, MAX 10) and for chips. Pixels and cycles stay the same.",
    ),
    "zeros": Option(
        Truth(),
        False,
        "Write initial zeros of memories that the core writes. Without this option these memories start "
        "undefined, and the core needs no initial value.",
    ),
    "attributes": Option(
        Choice("synthesis tool", ATTRIBUTES),
        None,
        "Write the attributes by which this tool puts memories into block RAMs or look-up tables, and "
        "products into multipliers.  [default: none]",
    ),
}
"""Options of a core's Verilog. `design.built` turns them into fields of `Build`."""

RENDERING: dict[str, Option] = {
    **{name: BUILD[name] for name in ("geometry", "lanes", "pipes", "setups")},
    # The size of the depth test is the picture's size, which is an option of the scene.
    "coarse": Option(
        Truth(),
        False,
        "With --geometry hardware: add a coarse depth test, which drops hidden spans before shading.",
        "pipeline.coarse",
    ),
    "specialise": Option(
        Truth(),
        False,
        "Build only the parts that the scene needs, list the others, and compare with the full pipeline.",
        "pipeline.specialise",
    ),
    "short_words": Option(
        Truth(),
        False,
        "With --specialise: also shorten words if the error bound stays. Pixels may change by one LSB.",
        "pipeline.short_words",
    ),
}
"""Options of a rendering."""


class SceneOptions(TypedDict, total=False):
    """Options of a scene from the table `SCENE`, by their names in Python."""

    size: tuple[int, int] | str
    background: ColorLike
    ambient_light: ColorLike
    back_faces: Literal["flip", "show", "cull"]
    triangles: int
    crease: float
    materials: Literal["file", "one"]
    projection: Literal["perspective", "orthographic"]
    view: Triple | str
    position: Triple | str
    target: Triple | str
    up: Triple | str
    field_of_view: float
    viewer: Literal["distant", "near"]
    lights: LightsLike
    point_lights: LightsLike
    spot_lights: LightsLike
    ambient: ColorLike
    diffuse: ColorLike
    specular: ColorLike
    exponent: int
    roughness: float
    fresnel: ColorLike


class DesignOptions(TypedDict, total=False):
    """Options of a design from the table `DESIGN`, by their names in Python."""

    method: str
    model: str | TabulatedModel
    operand: Operand
    gate: bool
    setup_interval: int
    style: Style
    transfer: Literal["srgb", "linear"]


class SharedOptions(TypedDict, total=False):
    """Options of `BUILD` that `RENDERING` has with the same type, by their names in Python."""

    geometry: Literal["software", "hardware"]
    lanes: Literal[1, 2, 4]
    pipes: Literal[1, 2, 4, 8]
    setups: Literal[1, 2, 4]


class BuildOptions(SharedOptions, total=False):
    """Options of a core from the table `BUILD`, by their names in Python."""

    merged: bool
    top: Literal["shader", "geometry", "render"]
    bus: Literal["native", "axi", "wishbone"]
    stream: Literal[32, 64, 128]
    coarse: tuple[int, int] | str
    memories: Literal["asynchronous", "synchronous"]
    zeros: bool
    attributes: Literal["vivado", "quartus", "synplify", "gowin"]


class RenderOptions(SceneOptions, DesignOptions, SharedOptions, total=False):
    """Options of a rendering, by their names in Python."""

    coarse: bool
    specialise: bool
    short_words: bool
