"""Build options of a design, which change its cost and its cycles, and no pixel."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from blysk.golden.lighting.highlight_operand import MAX_EXPONENT

if TYPE_CHECKING:
    from blysk.golden.geometry.coarse_depth import CoarseDepth

__all__ = [
    "ATTRIBUTES",
    "LANES",
    "MEMORIES",
    "PIPES",
    "PORTS",
    "SETUPS",
    "STREAMS",
    "STYLES",
    "TOPS",
    "Build",
    "BuildError",
    "Style",
]

Style = Literal["throughput", "compact"]
"""Name of a style."""

STYLES: tuple[Style, ...] = ("throughput", "compact")
"""Styles: one pixel a cycle, or few multipliers."""

PIPES = (1, 2, 4, 8)
"""Numbers of shading pipelines."""

LANES = (1, 2, 4)
"""Numbers of lanes of a shading pipeline: pixels in a beat."""

SETUPS = (1, 2, 4)
"""Numbers of lanes of triangle setup."""

TOPS = ("shader", "geometry", "render")
"""Cores: spans to pixels, triangles to spans, triangles to pixels."""

PORTS = ("native", "axi", "wishbone")
"""Ports of a core: its own streams, or a bus."""

STREAMS = (32, 64, 128)
"""Bits of a beat of AXI4-Stream, for a core on a bus."""

MEMORIES = ("asynchronous", "synchronous")
"""Reads of the memories in Verilog: some within a cycle, or all at a clock edge."""

ATTRIBUTES = ("vivado", "quartus", "synplify", "gowin")
"""Synthesis tools whose attributes the Verilog can have."""


class BuildError(ValueError):
    """Two options of a build exclude each other.

    Parameters
    ----------
    option : str
        Field of `Build`, or of the design, that contradicts another field.
    reason, remedy : str
        Reason of the conflict, and an action that mends it.
    """

    def __init__(self, option: str, reason: str, remedy: str):
        super().__init__(option, reason, remedy)
        self.option, self.reason, self.remedy = option, reason, remedy

    def __str__(self) -> str:
        return f"{self.option}: {self.reason}; {self.remedy}"


@dataclass(frozen=True)
class Build:
    """Build options of a design.

    A gate has a bit-accurate model, and frame constants of its own. So it is a field of `ShadingPipeline`.

    Parameters
    ----------
    style : {"throughput", "compact"}
        One pixel a cycle, or few multipliers.
    setup_interval : int or None
        Least number of cycles from a span to the next, for methods with this choice. A smaller number needs
        more multipliers. ``None``: the largest number up to 4 (``renormalise``: 3); in the compact style the
        largest number of all.
    exponent : int or None
        Specular exponent, fixed at build time; ``None``: the exponent is a frame constant.
    lanes : {1, 2, 4}
        Lanes of a pipeline. With N lanes an output beat has up to N neighbouring pixels of a span. Only the
        method ``quotient`` serves several lanes.
    pipes : {1, 2, 4, 8}
        Number of pipelines, see `PixelPipelines`.
    merged : bool
        Whether several pipelines give one stream of pixels in place of a stream each.
    top : {"shader", "geometry", "render"}
        The core: spans to pixels, triangles to spans, or triangles to pixels.
    setups : {1, 2, 4}
        Lanes of triangle setup of a core that takes triangles.
    geometry_style : {"throughput", "compact"} or None
        Style of the geometry of a core that takes triangles; ``None``: ``style``.
    coarse : CoarseDepth or None
        Depth test that drops hidden spans before shading. Only for a core from triangles to pixels.
    bus : {"native", "axi", "wishbone"}
        Ports: the core's own streams, or AXI4-Stream with registers on AXI4-Lite or Wishbone.
    stream : {None, 32, 64, 128}
        Bits of a beat of both AXI4-Streams of a core on a bus; ``None``: all bytes of a triangle, span or
        pixel.
    memories : {"asynchronous", "synchronous"}
        Reads of the memories in Verilog and in blysk fpga. ``synchronous`` is for FPGAs and chips whose
        memories have no read within a cycle. Each cycle stays the same.
    zeros : bool
        Whether Verilog gives initial zeros to memories that the core writes.
    attributes : {"vivado", "quartus", "synplify", "gowin"} or None
        Synthesis tool whose attributes place memories and multipliers in Verilog; ``None``: no attributes.

    Raises
    ------
    ValueError
        If a value is unknown or out of range. The error is a `BuildError` if two options exclude each other.
    """

    style: Style = "throughput"
    setup_interval: int | None = None
    exponent: int | None = None
    lanes: int = 1
    pipes: int = 1
    merged: bool = False
    top: str = "shader"
    setups: int = 1
    geometry_style: Style | None = None
    coarse: "CoarseDepth | None" = None
    bus: str = "native"
    stream: int | None = None
    memories: str = "asynchronous"
    zeros: bool = False
    attributes: str | None = None

    def __post_init__(self) -> None:
        for name, values in _CHOICES.items():
            if getattr(self, name) not in values:
                known = ", ".join(str(value) for value in values if value is not None)
                raise ValueError(f"{name} must be one of {known}, not {getattr(self, name)!r}")
        if self.exponent is not None and not 1 <= self.exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {self.exponent}")
        self._check_pairs()

    def _check_pairs(self) -> None:
        """Refuse options that exclude each other."""
        if self.takes_triangles and self.pipes > 1:
            raise BuildError("pipes", "triangles go to one pipeline", "leave out pipes, or use spans")
        if self.bus != "native" and self.pipes > 1:
            raise BuildError("pipes", f"a core on {self.bus} has one pipeline", "leave out pipes or bus")
        if self.bus == "native" and self.stream is not None:
            raise BuildError("stream", "the core's own ports are no AXI4-Stream", "also give bus")
        if self.merged and self.pipes == 1:
            raise BuildError("merged", "one pipeline has one stream", "also give pipes")
        self._check_lanes()
        triangles = "use top geometry or render"
        if self.setups > 1 and not self.takes_triangles:
            raise BuildError("setups", "spans need no triangle setup", triangles)
        if self.geometry_style is not None and not self.takes_triangles:
            raise BuildError("geometry_style", "spans need no geometry", triangles)
        if self.coarse is not None and self.top != "render":
            raise BuildError("coarse", "it needs a core from triangles to pixels", "also give top render")

    def _check_lanes(self) -> None:
        """Refuse options that exclude several lanes."""
        if self.lanes == 1:
            return
        for excludes, reason, remedy in (
            (self.compact, "a pixel of the compact style takes several cycles", "use the throughput style"),
            (self.top == "geometry", "geometry gives spans, and no pixels", "leave out lanes"),
            (
                self.takes_triangles and self.lanes > 2,
                "the renderer serves at most two lanes",
                "take two lanes, or use spans",
            ),
            (self.pipes > 1, "several pipelines give single pixels", "leave out lanes or pipes"),
            (self.bus != "native", f"a core on {self.bus} gives single pixels", "leave out lanes or bus"),
        ):
            if excludes:
                raise BuildError("lanes", reason, remedy)

    @property
    def shading(self) -> "Build":
        """The options of one shading pipeline, with all others at their defaults."""
        return Build(self.style, self.setup_interval, self.exponent, self.lanes)

    @property
    def pairs(self) -> bool:
        """Whether a span of two pixels is a pair, see `QuotientLanes`. Hardware geometry makes no pairs."""
        return self.lanes > 1 and not self.takes_triangles

    @property
    def takes_triangles(self) -> bool:
        """Whether triangles go into the core, in place of spans."""
        return self.top != "shader"

    @property
    def compact(self) -> bool:
        """Whether shading has the compact style."""
        return self.style == "compact"

    @property
    def compact_geometry(self) -> bool:
        """Whether geometry has the compact style."""
        return (self.geometry_style or self.style) == "compact"


_CHOICES = {
    "style": STYLES,
    "lanes": LANES,
    "pipes": PIPES,
    "top": TOPS,
    "setups": SETUPS,
    "geometry_style": (None, *STYLES),
    "bus": PORTS,
    "stream": (None, *STREAMS),
    "memories": MEMORIES,
    "attributes": (None, *ATTRIBUTES),
}
"""Values that are accepted, for fields that have few values."""
