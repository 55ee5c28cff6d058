"""A SoC of LiteX with a packaged core, as Verilog: ``python litex_soc.py FOLDER``, in the folder of the run.

``words.json`` has the words of memory. The pins ``host_*`` are a master of the SoC's bus in place of a CPU.
"""

import importlib.util
import json
import sys
from pathlib import Path

from litex.build.generic_platform import Pins, Subsignal
from litex.build.io import CRG
from litex.build.sim.platform import SimPlatform
from litex.soc.integration.export import get_csr_json
from litex.soc.integration.soc_core import SoCMini
from litex.soc.interconnect import wishbone

MEMORY = 0x40000000
WIDTHS = {"adr": 30, "dat_w": 32, "dat_r": 32, "sel": 4, "cyc": 1, "stb": 1, "we": 1, "ack": 1, "err": 1}
PINS = [("sys_clk", 0, Pins(1)), ("host", 0, *(Subsignal(name, Pins(bits)) for name, bits in WIDTHS.items()))]


class Soc(SoCMini):
    """The core, a memory, and pins of a bus master."""

    def __init__(self, platform, module, words, size):
        super().__init__(platform, int(1e6), ident="")
        self.crg = CRG(platform.request("sys_clk"))
        self.core = module.Core(platform, **({"size": size} if size else {}))
        self.core.add_to(self, "core", 0x90000000)
        self.add_ram("main_ram", MEMORY, 4 * len(words), contents=words)
        host, pins = (
            wishbone.Interface(data_width=32, adr_width=30, addressing="word"),
            platform.request("host"),
        )
        self.bus.add_master("host", host)
        for name in WIDTHS:
            pin, signal = getattr(pins, name), getattr(host, name)
            self.comb += pin.eq(signal) if name in ("dat_r", "ack", "err") else signal.eq(pin)


def main():
    """Write ``soc.v``, and ``soc.json`` with its sources and addresses."""
    folder = Path(sys.argv[1])
    spec = importlib.util.spec_from_file_location("core_litex", folder / "core_litex.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    given = json.loads(Path("words.json").read_text())
    platform = SimPlatform("SIM", PINS)
    soc = Soc(platform, module, given["words"], given["size"])
    soc.finalize()
    fragment = soc.get_fragment()
    platform.finalize(fragment)
    platform.get_verilog(fragment, name="soc").write("soc.v")
    registers = json.loads(get_csr_json(soc.csr_regions, soc.constants, soc.mem_regions))["csr_registers"]
    found = {
        "sources": [source[0] for source in platform.sources],
        "csr": {name: of["addr"] for name, of in registers.items()},
        "registers": soc.bus.regions["core_registers"].origin,
        "memory": MEMORY,
    }
    Path("soc.json").write_text(json.dumps(found))


if __name__ == "__main__":
    main()
