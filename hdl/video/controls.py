"""Controls: buttons that set the angle and the list of the next frames."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from blysk.golden.video.controls import BUTTONS, Controls
from blysk.golden.video.motion import ANGLE_BITS

__all__ = ["ControlsUnit"]


class ControlsUnit(wiring.Component):
    """Angle and list of each frame. `Controls` is the bit-accurate model.

    Buttons go through two flip-flops, and are sampled when a common counter is full. A press is a sample that
    is down after a sample that is up. Angle and list of a frame are valid from the cycle after ``frame`` on.
    Before the next ``frame`` only a press changes them. The unit has no multipliers.

    Parameters
    ----------
    model : Controls
        Bit-accurate model.

    Members
    -------
    buttons : :py:`In(4)`
        One bit for each of `BUTTONS`, 1 while the button is down. Any clock domain may drive the bits.
    frame : :py:`In(1)`
        High on the cycle on which a frame begins.
    angle : :py:`Out(12)`
        Angle of the frame.
    index : :py:`Out(range(materials * lights))`
        Index of the frame's list of draw commands.

    Source: docs/theory/video.md#bands; not in the documents.
    """

    def __init__(self, model: Controls | None = None):
        self.model = model or Controls()
        model = self.model
        super().__init__(
            {
                "buttons": In(len(BUTTONS)),
                "frame": In(1),
                "angle": Out(ANGLE_BITS),
                "index": Out(range(model.materials * model.lights)),
            }
        )

    def elaborate(self, platform):
        """Buttons, then the state."""
        m = Module()
        model = self.model
        pressed = dict(zip(BUTTONS, self._pressed(m), strict=True))
        angle = Signal(ANGLE_BITS, name="angle_now", init=model.first)
        running, backwards = Signal(name="running", init=1), Signal(name="backwards")
        chosen = [Signal(range(count), name=name) for name, count in self._counts()]
        turned = Mux(backwards, angle - model.step, angle + model.step)[:ANGLE_BITS]
        with m.If((self.frame & running) | (pressed["step"] & ~running)):
            m.d.sync += angle.eq(turned)
        with m.If(pressed["pause"]):
            m.d.sync += running.eq(~running)
        with m.If(pressed["step"] & running):
            m.d.sync += backwards.eq(~backwards)
        for (name, count), value in zip(self._counts(), chosen, strict=True):
            with m.If(pressed[name]):
                m.d.sync += value.eq(Mux(value == count - 1, 0, value + 1))
        m.d.comb += [self.angle.eq(angle), self.index.eq(chosen[1] * model.materials + chosen[0])]
        return m

    def _counts(self):
        return ("material", self.model.materials), ("light", self.model.lights)

    def _pressed(self, m: Module) -> Signal:
        """Whether each button goes down on this cycle, without bounces."""
        down = Signal(len(BUTTONS), name="down")
        count = Signal(self.model.debounce_bits, name="count")
        state, pressed = Signal.like(down, name="state"), Signal.like(down, name="pressed")
        m.submodules.down = FFSynchronizer(self.buttons, down)
        m.d.sync += count.eq(count + 1)
        with m.If(count.all()):
            m.d.sync += state.eq(down)
            m.d.comb += pressed.eq(down & ~state)
        return pressed
