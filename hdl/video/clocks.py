"""Clocks: a PLL that makes the clocks for drawing and for the display from a board's clock."""

from amaranth.hdl import ClockSignal, Const, Instance, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from blysk.golden.video.clock_plan import ClockPlan

__all__ = ["ClockUnit"]


class ClockUnit(wiring.Component):
    """The PLL of an ECP5, ``EHXPLLL``. It drives the domains ``sync``, ``pixel`` and ``serial``.

    Each clock has a gate, ``DCCA``, which lets only whole pulses through. A clock stands still until the PLL
    is locked. So every register starts as the configuration set it, and no register needs a reset. The net of
    a reset would go to half of the registers. The enclosing module defines the domains, without reset.

    Parameters
    ----------
    model : ClockPlan
        Dividers.

    Members
    -------
    reference : :py:`In(1)`
        The board's clock.

    Attributes
    ----------
    clocks : dict of str to Signal
        Clocks by domain, for constraints.

    Source: docs/theory/video.md#display; Lattice FPGA-TN-02200, ECP5 sysCLOCK PLL.
    """

    def __init__(self, model: ClockPlan):
        self.model = model
        self.clocks = {name: Signal(name=f"{name}_clock") for name in ("sync", "pixel", "serial")}
        super().__init__({"reference": In(1)})

    def elaborate(self, platform):
        """The PLL, and a gate for each clock."""
        m = Module()
        plan, locked, loop = self.model, Signal(name="locked"), Signal(name="loop")
        always = {name: Signal(name=f"{name}_always") for name in self.clocks}
        outputs = {
            "OP": (plan.loop, loop),
            "OS": (plan.serial, always["serial"]),
            "OS2": (plan.pixel, always["pixel"]),
            "OS3": (plan.draw, always["sync"]),
        }
        arguments = {}
        for (name, (divider, signal)), letter in zip(outputs.items(), "ABCD", strict=True):
            arguments |= {
                f"p_OUTDIVIDER_MUX{letter}": f"DIV{letter}",
                f"p_CLK{name}_ENABLE": "ENABLED",
                f"p_CLK{name}_DIV": divider,
                # Phase 0.
                f"p_CLK{name}_CPHASE": divider - 1,
                f"p_CLK{name}_FPHASE": 0,
                f"o_CLK{name}": signal,
            }
        m.submodules.pll = Instance(
            "EHXPLLL",
            a_ICP_CURRENT="12",
            a_LPF_RESISTOR="8",
            a_MFG_ENABLE_FILTEROPAMP="1",
            a_MFG_GMCREF_SEL="2",
            p_PLLRST_ENA="DISABLED",
            p_INTFB_WAKE="DISABLED",
            p_STDBY_ENABLE="DISABLED",
            p_DPHASE_SOURCE="DISABLED",
            p_FEEDBK_PATH="CLKOP",
            p_CLKI_DIV=plan.input_divider,
            p_CLKFB_DIV=plan.feedback_divider,
            **arguments,
            i_CLKI=self.reference,
            i_CLKFB=loop,
            o_LOCK=locked,
            **{f"i_{name}": Const(0) for name in ("RST", "STDBY", "PHASESEL0", "PHASESEL1", "PLLWAKESYNC")},
            **{f"i_{name}": Const(1) for name in ("PHASEDIR", "PHASESTEP", "PHASELOADREG")},
            **{f"i_{name}": Const(0) for name in ("ENCLKOP", "ENCLKOS", "ENCLKOS2", "ENCLKOS3")},
        )
        for name, clock in self.clocks.items():
            m.d.comb += ClockSignal(name).eq(clock)
            m.submodules[f"gate_{name}"] = Instance("DCCA", i_CLKI=always[name], i_CE=locked, o_CLKO=clock)
        return m
