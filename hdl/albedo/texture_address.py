"""Texture address unit: an address in each of four banks, and two weights."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.texel_memory import BANKS, LEVEL_BITS, TexelMemory
from blysk.golden.albedo.texture_address import TextureAddress
from blysk.golden.reference.texture import LARGEST_TEXTURE, WRAPS
from blysk.hdl.core.bits import select
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = [
    "TextureAddressUnit",
    "bank_addresses_shape",
    "descriptor_shape",
    "texel_request_shape",
    "texture_place_shape",
]

_INDEX_BITS = LARGEST_TEXTURE.bit_length() - 1
"""Bits of a column or row."""

_MIRROR, _CLAMP = WRAPS.index("mirror"), WRAPS.index("clamp")


def descriptor_shape() -> data.StructLayout:
    """Shape of a `TextureDescriptor`, constants of a material: the bits of its two words."""
    sampling = {"width": LEVEL_BITS, "height": LEVEL_BITS, "wrap": data.ArrayLayout(2, 2), "nearest": 1}
    return data.StructLayout({**sampling, "base": 18})


def texture_place_shape(model: TextureAddress) -> data.StructLayout:
    """Shape of a place on a texture: ``coordinates`` u and v in texels of the level, and the ``level``."""
    coordinates = data.ArrayLayout(FixedShape(model.coordinate_format), 2)
    return data.StructLayout({"coordinates": coordinates, "level": LEVEL_BITS})


def texel_request_shape(memory: TexelMemory) -> data.ArrayLayout:
    """Shape of a request: the address of a word in each bank."""
    return data.ArrayLayout(unsigned(memory.address_bits), BANKS)


def bank_addresses_shape(model: TextureAddress) -> data.StructLayout:
    """Shape of a `BankAddresses`: a request, and the weights of odd columns and of odd rows."""
    weight = data.ArrayLayout(FixedShape(model.weight_format), 2)
    return data.StructLayout({"address": texel_request_shape(model.memory), "weight": weight})


class TextureAddressUnit(PipelinedUnit):
    """Finds the four texels around a place, with wrapping, and their weights.

    `TextureAddress`, the bit-accurate model, has the rules. The latency is 7 cycles, and the initiation
    interval is 1. There is no multiplier. Adders find the half texel, the next column and row, the sizes of
    levels, and the weights.

    Parameters
    ----------
    model : TextureAddress
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(texture_place_shape(model)))`
        Places.
    o : :py:`Out(stream.Signature(bank_addresses_shape(model)))`
        Addresses and weights.
    constants : :py:`In(descriptor_shape())`
        The texture. Each of its levels has to fit the memory.

    Source: docs/theory/textures.md#addresses.
    """

    def __init__(self, model: TextureAddress | None = None):
        self.model = p = model or TextureAddress()
        self._graph = Dataflow(1)
        self._address, self._weight = self._describe()
        super().__init__(
            texture_place_shape(p),
            bank_addresses_shape(p),
            latency=max(word.stage for word in (*self._address, *self._weight)),
            constants=descriptor_shape(),
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        descriptor, bits = self.constants, self.model.memory.address_bits
        # First word behind level 0, counted from the base.
        self._behind = Signal(bits, name="behind")
        exponent = _less_one(descriptor.width) + _less_one(descriptor.height)
        m.d.sync += self._behind.eq((Const(1) << exponent)[:bits])
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for words, found in ((self._address, result.address), (self._weight, result.weight)):
            m.d.comb += [
                Value.cast(to).eq(at(word, self.latency)) for to, word in zip(found, words, strict=True)
            ]
        return result

    def _describe(self) -> tuple[list[Word], list[Word]]:
        """Words of the addresses and of the weights."""
        p, g = self.model, self._graph
        bits = p.memory.address_bits
        level = g.input("level", lambda operands: operands.level)
        sizes = [
            g.register(
                f"size_{axis}",
                lambda level, side=side: _reduced(self.constants[side], level),
                level,
                formula="log2 w",
            )
            for axis, side in (("u", "width"), ("v", "height"))
        ]
        (columns, across), (rows, down) = (self._axis(k, sizes[k]) for k in (0, 1))

        def place(exponent, texels, level):
            size = Mux(texels, (Const(1) << exponent)[:bits], 0)
            return Mux(level.any(), self._behind | size, 0)[:bits]

        def sum_of(width, height):
            # Only levels behind level 0 use this sum. Their sums fit these bits.
            return (_less_one(width) + _less_one(height))[: (bits - 1).bit_length()]

        exponent = g.register("exponent", sum_of, *sizes, formula="log2 S")
        texels = g.register("texels", lambda a, b: a.any() | b.any(), *sizes)
        place = g.register("place", place, exponent, texels, level)
        stride = g.register("stride", _less_one, sizes[0])

        def coarse(row, stride):
            return select([(row << k)[:bits] for k in (0, 4, 8)], stride[2:])

        def address(row, stride, column, place):
            row = select([(row << k)[:bits] for k in range(4)], stride[:2])
            return (row | column | place | self.constants.base << 1)[:bits]

        rows = [g.register(f"coarse_{odd}", coarse, row, stride) for odd, row in enumerate(rows)]
        found = [
            g.register(
                f"address_{bank}",
                address,
                rows[bank >> 1],
                stride,
                columns[bank & 1],
                place,
                formula="base + row·w/4 + column/2",
            )
            for bank in range(BANKS)
        ]
        return found, [across, down]

    def _axis(self, axis: int, size: Word) -> tuple[list[Word], Word]:
        """Words of the even and the odd column (or row), halved, and of the odd column's weight."""
        p, g, name = self.model, self._graph, "uv"[axis]
        share_bits = p.share_bits if p.bilinear else 0

        def shifted(coordinate):
            code = Value.cast(coordinate)
            if not p.bilinear:
                return code[p.share_bits :].as_signed()
            half = Cat(Const(0, p.share_bits - 1), ~self.constants.nearest)
            return (code - half)[: len(code) + 1].as_signed()

        coordinate = g.input(name, lambda operands: operands.coordinates[axis])
        place = g.register(f"place_{name}", shifted, coordinate, formula=f"{name} − 1/2")
        mask = g.register(
            f"mask_{name}", lambda size: Cat(size > k for k in range(_INDEX_BITS)), size, formula="w − 1"
        )
        indices = [g.wire(f"first_{name}", lambda place: place[share_bits:].as_signed(), place)]
        if p.bilinear:
            following = g.register(
                f"second_{name}", lambda place: (place[share_bits:].as_signed() + 1)[:-1].as_signed(), place
            )
            indices.append(following)
        wrapped = [self._wrapped(axis, k, index, mask) for k, index in enumerate(indices)]
        if not p.bilinear:
            index = wrapped[0]
            half = g.register(f"half_{name}", lambda index: index[1:], index)
            one = g.register(f"weight_{name}", lambda index: FixedValue(p.weight_format, index[0]), index)
            return [half, half], one

        def share(place, first, second):
            counts = (first[0] ^ second[0]) & ~self.constants.nearest
            return Cat(Mux(counts, place[:share_bits], 0), first[0])

        def weight(share):
            odd = share[-1]
            code = Cat(share[:-1] ^ odd.replicate(share_bits), 0) + odd
            return FixedValue(p.weight_format, code[: share_bits + 1])

        halves = [
            g.register(
                f"{parity}_{name}",
                lambda first, second, odd=odd: Mux(first[0] ^ odd, second[1:], first[1:]),
                *wrapped,
            )
            for odd, parity in enumerate(("even", "odd"))
        ]
        share = g.register(f"share_{name}", share, place, *wrapped)
        return halves, g.register(f"weight_{name}", weight, share)

    def _wrapped(self, axis: int, k: int, index: Word, mask: Word) -> Word:
        """Word of an index inside the image."""
        g, name = self._graph, f"{('first', 'second')[k]}_{'uv'[axis]}"

        def flags(index, mask):
            wrap, negative = self.constants.wrap[axis], index[-1]
            # The bit of the index above the mask tells whether a tile is mirrored.
            above = Cat(Const(1, 1), mask) & ~Cat(mask, Const(0, 1))
            inverted = (wrap == _MIRROR) & (index[: _INDEX_BITS + 1] & above).any()
            beyond = index[_INDEX_BITS:-1].any() | (index[:_INDEX_BITS] & ~mask).any()
            clamps = wrap == _CLAMP
            return Cat(inverted, clamps & beyond & ~negative, clamps & negative)

        def inside(index, mask, flags):
            inverted, ends, begins = (bit.replicate(_INDEX_BITS) for bit in flags)
            return ((index[:_INDEX_BITS] ^ inverted) | ends) & mask & ~begins

        flags = g.register(f"flags_{name}", flags, index, mask)
        return g.register(f"wrapped_{name}", inside, index, mask, flags)


def _less_one(size: Value) -> Value:
    """A logarithm minus one, but at least 0."""
    return (size - size.any())[: len(size)]


def _reduced(size: Value, level: Value) -> Value:
    """Logarithm of a side at a level."""
    difference = (size - level)[: LEVEL_BITS + 1]
    return Mux(difference[-1], 0, difference[:-1])
