"""The design of the Python interface, with its cost."""

from dataclasses import dataclass, fields, replace
from statistics import median
from typing import Any, get_args

from blysk.golden import pipeline
from blysk.golden.methods.interpolator import Operand
from blysk.golden.presets import preset
from blysk.sim.api.placed import design_of, read_store

__all__ = ["Design", "DesignCost"]


@dataclass(frozen=True)
class DesignCost:
    """Cost of a pipeline, counted in its netlist; resources of an FPGA if a placement is committed.

    Parameters
    ----------
    multipliers : int
        Multipliers of two words of any width, neither of them a constant.
    multiplier_widths : dict of (int, int) to int
        Number of multipliers by the widths of their operands; the wider operand is first.
    register_bits, memory_bits : int
        Bits of flip-flops and of memories, before technology mapping.
    cycles_per_pixel : int
        Cycles for each pixel of a long span.
    setup_interval : int
        A span of n pixels takes at most max(``cycles_per_pixel`` n, ``setup_interval``) cycles.
    latency : int
        Cycles from a span to its first pixel.
    luts, flip_flops, block_rams : int or None
        Resources of ``device`` that ``blysk fpga`` used; ``None`` if this design is not in `placed.STORE`.
    clock_mhz : float or None
        Median clock rate over the seeds of the placement.
    device, placed_on : str or None
        The FPGA, and the date of the placement.
    """

    multipliers: int
    multiplier_widths: dict[tuple[int, int], int]
    register_bits: int
    memory_bits: int
    cycles_per_pixel: int
    setup_interval: int
    latency: int
    luts: int | None = None
    flip_flops: int | None = None
    block_rams: int | None = None
    clock_mhz: float | None = None
    device: str | None = None
    placed_on: str | None = None

    def __str__(self) -> str:
        """Two lines: netlist and cycles; placement."""
        widths = ", ".join(f"{n}*{wide}x{narrow}" for (wide, narrow), n in self.multiplier_widths.items())
        netlist = (
            f"{self.multipliers} multipliers ({widths or 'none'}), {self.register_bits:,} register bits, "
            f"{self.memory_bits:,} memory bits; cycles: {self.cycles_per_pixel} a "
            f"pixel, at least {self.setup_interval} a span, latency {self.latency}"
        )
        if self.luts is None:
            return f"{netlist}\nnot placed; blysk fpga places it"
        return (
            f"{netlist}\n{self.luts:,} LUT, {self.flip_flops:,} flip-flops, {self.block_rams} block RAMs, "
            f"{self.clock_mhz:.0f} MHz on {self.device}, {self.placed_on}"
        )


class Design(pipeline.ShadingPipeline):
    """A design of the golden layer that also has the method `cost`. It equals the golden design."""

    @classmethod
    def of(cls, design: pipeline.ShadingPipeline) -> "Design":
        """The same design as an object with `cost`."""
        return cls(**{field.name: getattr(design, field.name) for field in fields(design)})

    def cost(self) -> DesignCost:
        """Multipliers, bits and cycles of the unit, and resources of an FPGA if a placement is committed.

        Each call writes and counts the netlist, which takes seconds.
        """
        # The hardware's description takes a second to import.
        from blysk.hdl.emit.cost import cost_of
        from blysk.hdl.pipeline import ShadingPipelineUnit

        unit = ShadingPipelineUnit(self)
        cost = cost_of(unit)
        return DesignCost(
            multipliers=cost.multiplier_count,
            multiplier_widths=cost.multipliers,
            register_bits=cost.register_bits,
            memory_bits=cost.rom_bits + cost.ram_bits,
            cycles_per_pixel=unit.cycles_per_pixel,
            setup_interval=unit.setup_interval,
            latency=unit.latency,
            **self.placed(),
        )

    def placed(self) -> dict[str, Any]:
        """Figures of `DesignCost` from the committed placement of this design; empty if there is none."""
        shading = replace(self, build=self.build.shading)
        for entry in read_store():
            # Devices that were only mapped have no clock rate.
            words = design_of(entry["design"]) if entry["fmax_mhz"] else None
            if words is None or words[:2] != (self.method, self.model):
                continue
            operand: Any = next((word for word in words[2:] if word in get_args(Operand)), None)
            lanes = next((int(word[0]) for word in words[2:] if word.endswith("lanes")), 1)
            if preset(words[0], words[1], operand=operand).built(lanes=lanes) == shading:
                return {
                    **{name: entry[name] for name in ("luts", "flip_flops", "block_rams", "device")},
                    "clock_mhz": median(entry["fmax_mhz"]),
                    "placed_on": entry["date"],
                }
        return {}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, pipeline.ShadingPipeline):
            return NotImplemented
        return all(getattr(self, field.name) == getattr(other, field.name) for field in fields(self))

    __hash__ = pipeline.ShadingPipeline.__hash__
