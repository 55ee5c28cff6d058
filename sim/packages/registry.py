"""Every kind of package, by name."""

from blysk.sim.packages.package import Package

__all__ = ["PACKAGES"]

_BUSES = ("axi", "wishbone")

PACKAGES: dict[str, Package] = {
    package.name: package
    for package in (
        Package("fusesoc", "a core file with targets lint, sim (Icarus) and verilator", benched=True),
        Package("systemrdl", "its registers in SystemRDL", _BUSES),
        Package(
            "ipxact",
            "its registers in IP-XACT (IEEE 1685-2014)",
            _BUSES,
            modules=("systemrdl", "peakrdl_ipxact"),
        ),
        Package(
            "litex",
            "a module of LiteX with DMA and an interrupt",
            ("wishbone",),
            tops=("shader", "render"),
            whole_beats=True,
        ),
        Package("vivado", "a Tcl script and a wrapper, untried in Vivado", ("axi",)),
    )
}
"""Kinds of packages. The command, its help, the guide and the tests iterate over them."""
