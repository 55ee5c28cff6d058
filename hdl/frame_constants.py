"""Frame constants: the registers behind the write port."""

from amaranth.hdl import Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.frame_constants import (
    BANK_ADDRESS,
    EMISSION_ADDRESS,
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    MATERIAL_ADDRESS,
    MAX_MATERIALS,
    TEXTURE_ADDRESS,
    THRESHOLD_ADDRESS,
    TINTED_ADDRESS,
)
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Format
from blysk.hdl.albedo.texture_address import descriptor_shape
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.lighting.intensity import color_shape

__all__ = ["FrameConstantsUnit", "existing_material", "frame_constants_shape", "write_shape"]


def write_shape() -> data.StructLayout:
    """Shape of a write: address and 18 bits of data."""
    return data.StructLayout({"address": unsigned(9), "data": unsigned(18)})


def existing_material(index: Value, materials: int) -> Value:
    """Index of a material. An index past the last material counts as the last."""
    return index if materials == 1 << len(index) else Mux(index >= materials, materials - 1, index)


def frame_constants_shape(
    lights: int, threshold: Format | None = None, banks: int = 1, albedo: Albedo | None = None
) -> data.StructLayout:
    """Shape of all constants of a frame.

    Parameters
    ----------
    lights, threshold, banks, albedo
        Those of `FrameConstantsUnit`.
    """
    light = {
        "direction": normal_shape(),
        "halfway": normal_shape(),
        "diffuse": color_shape(),
        "specular": color_shape(),
    }
    tables = {} if threshold is None else {"threshold": unsigned(threshold.width)}
    if banks > 1:
        tables["bank"] = range(banks)
    colored = {} if albedo is None else {"emission": color_shape()}
    if albedo is not None and albedo.tints:
        colored["tinted"] = unsigned(1)
    if albedo is not None and albedo.texture is not None:
        colored["texture"] = descriptor_shape()
    return data.StructLayout(
        {
            **tables,
            "exponent": unsigned(Specular.EXPONENT_BITS),
            "ambient": color_shape(),
            "lights": data.ArrayLayout(data.StructLayout(light), lights),
            **colored,
        }
    )


class FrameConstantsUnit(wiring.Component):
    """Registers of the frame constants. A write changes one word.

    A write is accepted on a cycle on which ``hold`` is low. Words have 18 bits. A shorter constant takes the
    low bits of its word. A write to an address without a constant is accepted, and changes nothing. Reset
    clears every constant: exponent 0 and black light. Exponents 0 and 1001 to 1023 are accepted. They shade
    by the same formula, outside the stated error.

    `address_table` lists the addresses and formats of a design's constants. Verilog has this list in its
    header. Tables of lobes take the writes to `LOBE_ADDRESS`, see `LobeMemory`. The texel memory takes those
    to `TEXELS_ADDRESS` and `TEXEL_ADDRESS`, see `LoadedTextures.writes`.

    A constant has its value 2 cycles after its write was accepted. With several materials the exponent and
    the colours are in memories, one for each word. The memories are written for the material whose index was
    last written to `MATERIAL_ADDRESS`. They are read for ``material``: 1 cycle after ``material`` changes,
    and 3 cycles after a write. All 18 bits of an index count. Writes for an index past the last material are
    lost. A write of a bank past the last bank is lost, too. A unit of one material has no index, and ignores
    `MATERIAL_ADDRESS`. Reset does not clear memories.

    Parameters
    ----------
    lights : int
        Number of lights.
    materials : int
        Number of materials, 1 to `MAX_MATERIALS`.
    threshold : Format or None
        Format of a threshold for each material, see `ShadingPipeline.threshold_of`. ``None``: no threshold.
    banks : int
        Number of tables of lobes that materials choose from.
    albedo : Albedo or None
        Albedo path of the pipeline.

    Raises
    ------
    ValueError
        If the number of materials is out of range.

    Members
    -------
    write : :py:`In(stream.Signature(write_shape()))`
        Writes.
    hold : :py:`In(1)`
        While it is high, no write is accepted.
    material : :py:`In(range(materials))`
        Index of the material whose constants are read. Only with several materials.
    constants : :py:`Out(frame_constants_shape(lights, threshold, banks, albedo))`
        The constants.

    Source: docs/theory/units.md#frame-constants.
    """

    def __init__(
        self,
        lights: int,
        materials: int = 1,
        threshold: Format | None = None,
        banks: int = 1,
        albedo: Albedo | None = None,
    ):
        if not 1 <= materials <= MAX_MATERIALS:
            raise ValueError(f"materials must be 1 to {MAX_MATERIALS}, not {materials}")
        self.lights = lights
        self.materials, self.banks, self.albedo = materials, banks, albedo
        self.tables = {}
        if threshold is not None:
            self.tables[THRESHOLD_ADDRESS] = "threshold"
        if banks > 1:
            self.tables[BANK_ADDRESS] = "bank"
        members = {
            "write": In(stream.Signature(write_shape())),
            "hold": In(1),
            "constants": Out(frame_constants_shape(lights, threshold, banks, albedo)),
        }
        if materials > 1:
            members["material"] = In(range(materials))
        super().__init__(members)

    def elaborate(self, platform):
        """A register or memory for each word, and registers for the data and the partly decoded address."""
        m = Module()
        m.d.comb += self.write.ready.eq(~self.hold)
        words, of_material = {}, set()
        for name, (first, count) in FIELDS_OF_A_FRAME.items():
            field = self.constants[name]
            words |= {first + k: field[k] if count > 1 else field for k in range(count)}
            of_material |= set(range(first, first + count))
        for address, name in self.tables.items():
            words[address] = self.constants[name]
            of_material.add(address)
        if self.albedo is not None:
            words |= (colored := self._albedo_words())
            of_material |= colored.keys()
        for light in range(self.lights):
            base = (light + 1) * LIGHT_STRIDE
            for name, (first, count) in FIELDS_OF_A_LIGHT.items():
                addresses = range(base + first, base + first + count)
                words |= dict(zip(addresses, self.constants.lights[light][name], strict=True))
                if name in ("diffuse", "specular"):
                    of_material |= set(addresses)
        accepted = self.write.valid & self.write.ready
        word_data = Signal.like(self.write.payload.data)
        m.d.sync += word_data.eq(self.write.payload.data)
        if self.materials > 1:
            index, there_is = Signal(range(self.materials)), Signal(name="there_is_the_material", init=1)
            with m.If(accepted & (self.write.payload.address == MATERIAL_ADDRESS)):
                m.d.sync += index.eq(self.write.payload.data)
                m.d.sync += there_is.eq(self.write.payload.data < self.materials)
        there_is_the_bank = Const(1)
        if self.banks > 1:
            there_is_the_bank = Signal(name="there_is_the_bank")
            m.d.sync += there_is_the_bank.eq(self.write.payload.data < self.banks)
        # The upper bits of the address select a light or the frame. The lower bits select a word of it.
        address, decoded = self.write.payload.address, {}
        for kind, digits, part in (
            ("light", {word // LIGHT_STRIDE for word in words}, address[LIGHT_STRIDE.bit_length() - 1 :]),
            ("field", {word % LIGHT_STRIDE for word in words}, address[: LIGHT_STRIDE.bit_length() - 1]),
        ):
            for digit in sorted(digits):
                decoded[kind, digit] = is_digit = Signal(name=f"{kind}_{digit}")
                m.d.sync += is_digit.eq((part == digit) & (accepted if kind == "light" else 1))
        for address, word in words.items():
            code = Value.cast(word)
            light, field = divmod(address, LIGHT_STRIDE)
            written = decoded["light", light] & decoded["field", field]
            if address == BANK_ADDRESS:
                written &= there_is_the_bank
            if self.materials > 1 and address in of_material:
                memory = Memory(shape=len(code), depth=self.materials, init=[])
                m.submodules[f"word_{address}"] = memory
                write, read = memory.write_port(), memory.read_port()
                m.d.comb += [
                    write.addr.eq(index),
                    write.data.eq(word_data[: len(code)]),
                    write.en.eq(written & there_is),
                    read.addr.eq(self.material),
                    code.eq(read.data),
                ]
            else:
                register = Signal(len(code), name=f"word_{address}")
                m.d.comb += code.eq(register)
                with m.If(written):
                    m.d.sync += register.eq(word_data[: len(code)])
        return m

    def _albedo_words(self) -> dict[int, Value]:
        """Words of the constants of an albedo, by address."""
        constants = self.constants
        words = {EMISSION_ADDRESS + k: Value.cast(color) for k, color in enumerate(constants.emission)}
        if self.albedo.tints:
            words[TINTED_ADDRESS] = Value.cast(constants.tinted)
        if self.albedo.texture is not None:
            bits = Value.cast(constants.texture)
            base = Value.cast(constants.texture.base)
            first = bits[: len(bits) - len(base)]
            words |= {TEXTURE_ADDRESS: first, TEXTURE_ADDRESS + 1: base}
        return words
