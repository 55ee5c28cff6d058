"""The map of a core's registers on a bus, and the bit-accurate model of the register file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from blysk.golden.frame_constants import (
    AXES_ADDRESS,
    AXIS_STRIDE,
    BANK_ADDRESS,
    EMISSION_ADDRESS,
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    LOBE_ADDRESS,
    MATERIAL_ADDRESS,
    TEXEL_ADDRESS,
    TEXELS_ADDRESS,
    TEXTURE_ADDRESS,
    THRESHOLD_ADDRESS,
    TINTED_ADDRESS,
)
from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import LIMIT_BITS
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.unit_vector import COMPONENT
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.scene import BACK_FACES

__all__ = [
    "ADDRESS_BITS",
    "CONSTANTS",
    "ERRORS",
    "IDENTITY",
    "VERSION",
    "WORD_BITS",
    "Register",
    "RegisterFile",
    "RegisterMap",
    "constant_registers",
    "frame_registers",
]

ADDRESS_BITS = 12
"""Number of bits of a byte address."""

WORD_BITS = 32
"""Bits of a register."""

IDENTITY = int.from_bytes(b"BLSK", "big")
"""Value of the first register."""

VERSION = 2
"""Version of the map."""

FRAME, COUNTERS, CONSTANTS = 0x040, 0x080, 0x800
"""First address of the registers of the picture, of the counters, and of the frame constants."""

ERRORS = {
    "unmapped": "no register at the address, or a write of a word at no multiple of 4",
    "read_only": "a write to a register that is read-only",
    "write_only": "a read of a register that is write-only",
    "value": "a value that its register does not hold",
    "strobe": "a write of some bytes of a word",
    "busy": "a write of a frame register or constant while a frame is inside",
}
"""Causes for which an access is refused: the bits of the register ``errors``, from bit 0 on."""


@dataclass(frozen=True)
class Register:
    """A register.

    Parameters
    ----------
    name : str
        A C identifier in lower case.
    address : int
        Address of its first byte, a multiple of 4.
    access : str
        One of ``"read-only"``, ``"read-write"`` (reset to 0), ``"write-only"`` and ``"clear"``. With
        ``"clear"`` a written 1 clears its bit, and a written 1 for a missing bit does nothing.
    width : int
        Bits of its value.
    signed : bool
        Whether the value is in two's complement. It is then sign-extended to 32 bits.
    text : str
        Description.
    format : str
        Number format.
    bits : tuple of (str, int, int, str)
        Parts of the value: name, first bit, number of bits, description.
    range : (int, int), optional
        Least and largest value, if not all codes are values.
    """

    name: str
    address: int
    access: str
    width: int
    signed: bool = False
    text: str = ""
    format: str = ""
    bits: tuple[tuple[str, int, int, str], ...] = ()
    range: tuple[int, int] | None = None

    def holds(self, data: int) -> bool:
        """Whether a written word of 32 bits is a value that the register can hold."""
        if data != self.extended(data) or self.range is None:
            return data == self.extended(data)
        low, high = self.range
        return low <= data - (self.signed and data >> (WORD_BITS - 1)) * (1 << WORD_BITS) <= high

    def extended(self, code: int) -> int:
        """The word of 32 bits that holds a code."""
        code &= (1 << self.width) - 1
        negative = self.signed and code >> (self.width - 1)
        return code | ((1 << WORD_BITS) - (1 << self.width) if negative else 0)


def frame_registers(keep: bool = False) -> list[Register]:
    """Registers of the picture, for a core that takes triangles; see `FrameSettings`.

    Parameters
    ----------
    keep : bool
        Whether the core tests depths. Each frame clears the depths unless they are kept.
    """
    borders = {
        "left": "first column of the picture on the grid",
        "top": "first row of the picture on the grid",
        "right": "column after the last column",
        "bottom": "row after the last row",
    }
    kinds = ", ".join(f"{k}: {name}" for k, name in enumerate(BACK_FACES))
    most = 1 << X_BITS - 2
    chord = "largest chord between the unit normals of a span's ends, in 1/1024"
    rows = [(name, X_BITS, True, f"{text}; pixels, -{most} to {most}") for name, text in borders.items()]
    rows += [
        ("back_faces", 2, False, f"back faces, {kinds}"),
        ("limit", LIMIT_BITS, False, f"{chord}; not read where spans have true lines or vectors"),
    ]
    if keep:
        rows.append(
            ("keep", 1, False, "1: the next frame adds to the picture; 0: it clears the depths first")
        )
    ranges = dict.fromkeys(borders, (-most, most)) | {"back_faces": (0, len(BACK_FACES) - 1)}
    return [
        Register(name, FRAME + 4 * k, "read-write", width, signed, text, range=ranges.get(name))
        for k, (name, width, signed, text) in enumerate(rows)
    ]


_OF_A_FRAME = {
    "exponent": "specular exponent, 1 to 1000",
    "ambient": "ambient colour, 255 times its value",
}
_OF_A_LIGHT = {
    "diffuse": "diffuse colour, 255 times coefficient times light",
    "specular": "specular colour, 255 times coefficient times light",
}


def constant_registers(design: ShadingPipeline, axes: Sequence[str] = ()) -> list[Register]:
    """Registers of the frame constants: one for each address of the write port, from `CONSTANTS` on.

    Parameters
    ----------
    design : ShadingPipeline
        The shading pipeline.
    axes : sequence of str
        Axes that each further light has, see `Renderer.axes`.
    """
    color, component = Intensity.COLOR_FORMAT, COMPONENT
    formats = {"exponent": (Specular.EXPONENT_BITS, False, "")} | dict.fromkeys(
        ("ambient", "diffuse", "specular"), (color.width, False, str(color))
    )
    formats |= dict.fromkeys(("direction", "halfway"), (component.width, True, str(component)))
    rows = []

    def add(prefix: str, base: int, fields: Mapping[str, tuple[int, int]], texts: Mapping[str, str]) -> None:
        for name, (first, count) in fields.items():
            for k in range(count):
                part = "" if count == 1 else f"_{('xyz' if formats[name][1] else 'rgb')[k]}"
                rows.append((f"{prefix}{name}{part}", base + first + k, *formats[name], texts[name]))

    add("", 0, FIELDS_OF_A_FRAME, _OF_A_FRAME)
    if design.materials > 1:
        text = "index of the material to which the next exponent and colours belong"
        rows.append(("material", MATERIAL_ADDRESS, (design.materials - 1).bit_length(), False, "", text))
    if design.loads_tables:
        text = "next value of a table, UQ(0, 17); with bit 17 set, number of the bank whose table begins"
        rows.append(("lobe", LOBE_ADDRESS, 18, False, "", text))
    if design.threshold_format is not None:
        form = design.threshold_format
        text = "threshold of a material's table, where its highlight ends"
        rows.append(("threshold", THRESHOLD_ADDRESS, form.width, False, str(form), text))
    if design.banks > 1:
        width = (design.banks - 1).bit_length()
        rows.append(("bank", BANK_ADDRESS, width, False, "", "bank of a material's table"))
    rows += _albedo_rows(design)
    meanings = design.interpolator.light_meanings
    texts_of_a_light = _OF_A_LIGHT | {
        name: text if text == "not read" else f"{text}, component times {meanings.one}"
        for name, text in meanings.texts.items()
    }
    for light in range(design.lights):
        add(f"light{light}_", (light + 1) * LIGHT_STRIDE, FIELDS_OF_A_LIGHT, texts_of_a_light)
    for light in range(1, design.lights):
        for row, axis in enumerate(axes):
            base = AXES_ADDRESS + light * LIGHT_STRIDE + row * AXIS_STRIDE
            text = f"axis {axis} in the frame of light 0, component times 2^17"
            words = component.width, True, str(component), text
            rows += [(f"light{light}_axis_{axis[0]}_{'xyz'[k]}", base + k, *words) for k in range(3)]
    ranges = {"material": (0, design.materials - 1), "bank": (0, design.banks - 1)}
    return [
        Register(
            name,
            CONSTANTS + 4 * address,
            "write-only",
            width,
            signed,
            text,
            form,
            range=ranges.get(name),
        )
        for name, address, width, signed, form, text in sorted(rows, key=lambda row: row[1])
    ]


def _albedo_rows(design: ShadingPipeline) -> list[tuple[str, int, int, bool, str, str]]:
    """Name, address, width, sign, format and text of each constant of a design with an albedo."""
    albedo, color = design.albedo, Intensity.COLOR_FORMAT
    if albedo is None:
        return []
    text = "emission of the material, 255 times its value"
    rows = [
        (f"emission_{channel}", EMISSION_ADDRESS + k, color.width, False, str(color), text)
        for k, channel in enumerate("rgb")
    ]
    if albedo.tints:
        text = "1: the albedo multiplies the specular sum of the material, too"
        rows.append(("tinted", TINTED_ADDRESS, 1, False, "", text))
    if albedo.texture is None:
        return rows
    texts = {
        "texture": (TEXTURE_ADDRESS, 13, "texture of the material: sizes, wrap and filter"),
        "texture_base": (TEXTURE_ADDRESS + 1, 18, "texture of the material: base, in pairs of words"),
        "texels": (TEXELS_ADDRESS, 18, "index from which the texels written next begin, in pairs of words"),
        "texel": (TEXEL_ADDRESS, 18, "next half of a word of texels"),
    }
    return rows + [(name, address, bits, False, "", text) for name, (address, bits, text) in texts.items()]


@dataclass(frozen=True)
class RegisterMap:
    """Every register of a core.

    Parameters
    ----------
    core : str
        Name of the core, for people.
    counters : sequence of (str, int, str)
        Counters since the reset: name, bits, description.
    picture : sequence of Register
        Registers of the picture, if the core has some.
    constants : sequence of Register
        Registers of the frame constants, if the core has some.

    Source: docs/theory/bus.md#registers.
    """

    core: str
    counters: Sequence[tuple[str, int, str]] = ()
    picture: Sequence[Register] = ()
    constants: Sequence[Register] = ()

    @cached_property
    def registers(self) -> tuple[Register, ...]:
        """All registers, by ascending address."""
        causes = tuple((name, k, 1, text) for k, (name, text) in enumerate(ERRORS.items()))
        state = (("busy", 0, 1, "a frame is inside, from its first beat in to its last beat out"),)
        control = [
            Register("identity", 0x000, "read-only", 32, text=f'"BLSK", 0x{IDENTITY:08X}'),
            Register("version", 0x004, "read-only", 16, text=f"version of this map, {VERSION}"),
            Register("state", 0x008, "read-only", 1, text="what the core does", bits=state),
            Register(
                "errors",
                0x00C,
                "clear",
                len(ERRORS),
                text="why accesses were refused; a 1 clears its bit",
                bits=causes,
            ),
            Register("refused", 0x010, "read-only", ADDRESS_BITS, text="address of the last refused access"),
        ]
        counters = [
            Register(name, COUNTERS + 4 * k, "read-only", width, text=f"{text}; since the reset")
            for k, (name, width, text) in enumerate(self.counters)
        ]
        return (*control, *self.picture, *counters, *self.constants)

    def __getitem__(self, name: str) -> Register:
        """The register with this name."""
        return self.by_name[name]

    @cached_property
    def by_name(self) -> dict[str, Register]:
        """Registers by name."""
        return {register.name: register for register in self.registers}

    @cached_property
    def by_address(self) -> dict[int, Register]:
        """Registers by address."""
        return {register.address: register for register in self.registers}


@dataclass
class RegisterFile:
    """Bit-accurate model of the registers: an answer for each access, one after the other.

    Parameters
    ----------
    map : RegisterMap
        The registers.
    values : dict of str to int
        Values of the registers by name, by default 0. The core sets the read-only registers.
    """

    map: RegisterMap
    values: dict[str, int] = field(default_factory=dict)

    def access(
        self, address: int, data: int | None = None, strobe: int = 15, busy: bool = False
    ) -> tuple[int, str]:
        """The read word (0 for a write), and the cause of a refusal (an empty text if there is none).

        Parameters
        ----------
        address : int
            Byte address, 12 bits. A read, or a write of some bytes, takes the word that contains it.
        data : int, optional
            The word to write; ``None``: a read.
        strobe : int
            One bit for each byte, 1 if the byte is written. A write of no byte changes nothing.
        busy : bool
            Whether the core is working on a frame.
        """
        register = self.map.by_address.get(address & ~3)
        whole = data is not None and strobe == 15
        cause = self._refusal(None if whole and address % 4 else register, data, strobe, busy)
        if cause or register is None:
            self.values["errors"] = self.values.get("errors", 0) | 1 << list(ERRORS).index(cause)
            self.values["refused"] = address
            return 0, cause
        if data is None:
            fixed = {"identity": IDENTITY, "version": VERSION, "state": int(busy)}
            return register.extended(fixed.get(register.name, self.values.get(register.name, 0))), ""
        if register.access == "clear":
            written = sum(0xFF << 8 * byte for byte in range(4) if strobe >> byte & 1)
            self.values[register.name] = self.values.get(register.name, 0) & ~(data & written)
        elif strobe:
            self.values[register.name] = data & (1 << register.width) - 1
        return 0, ""

    @staticmethod
    def _refusal(register: Register | None, data: int | None, strobe: int, busy: bool) -> str:
        """The first cause for which the access is refused."""
        if register is None:
            return "unmapped"
        if data is None:
            return "write_only" if register.access == "write-only" else ""
        if not strobe:
            return ""
        if register.access == "read-only":
            return "read_only"
        if register.access == "clear":
            return ""
        if strobe != 15:
            return "strobe"
        if not register.holds(data):
            return "value"
        return "busy" if busy else ""
