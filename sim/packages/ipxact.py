"""IP-XACT: the registers of a core on a bus, made from SystemRDL by PeakRDL."""

from pathlib import Path
from tempfile import TemporaryDirectory

from blysk.sim.packages.package import Core
from blysk.sim.packages.systemrdl import register_text
from blysk.sim.run_files import MARK

__all__ = ["files"]


def files(core: Core) -> dict[str, str]:
    """Texts of the package, by path."""
    # Both come with the extra ``packages``, and no other command needs them.
    from peakrdl_ipxact import IPXACTExporter, Standard
    from systemrdl import RDLCompiler

    with TemporaryDirectory() as folder:
        source, made = Path(folder) / "registers.rdl", Path(folder) / "registers.xml"
        source.write_text(register_text(core), encoding="utf-8")
        compiler = RDLCompiler()
        compiler.compile_file(str(source))
        exporter = IPXACTExporter(
            standard=Standard.IEEE_1685_2014,
            vendor="blysk",
            library="shading",
            version=core.version,
            xml_indent="  ",
            xml_newline="\n",
        )
        exporter.export(compiler.elaborate(), str(made), component_name=core.name)
        text = made.read_text(encoding="utf-8")
    head, _, rest = text.partition("\n")
    return {f"{core.name}.xml": f"{head}\n<!-- {MARK} -->\n{rest}"}
