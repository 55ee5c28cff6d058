"""Controls: angle and preset of the next frames, by buttons."""

from dataclasses import dataclass, replace

from blysk.golden.video.motion import ANGLE_BITS

__all__ = ["BUTTONS", "ControlState", "Controls"]

BUTTONS = ("pause", "step", "material", "light")
"""Buttons: stop or go on; turn the other way (in a pause: turn by one step); next material; next light."""


@dataclass(frozen=True)
class ControlState:
    """State of the controls between frames.

    Parameters
    ----------
    angle : int
        Code of the frame's angle.
    running, backwards : bool
        Whether the angle changes from frame to frame, and whether the angle decreases.
    material, light : int
        Indices of the chosen preset.
    """

    angle: int = 0
    running: bool = True
    backwards: bool = False
    material: int = 0
    light: int = 0


@dataclass(frozen=True)
class Controls:
    """Angle and preset of each frame, controlled by buttons.

    A button is sampled every ``2^debounce_bits`` cycles, longer than it bounces. A button is pressed if it is
    down in a sample and was up in the sample before. In a pause a press of ``step`` turns by one step. Else
    it reverses the motion. The list of a frame has the index ``light * materials + material``.

    Parameters
    ----------
    materials, lights : int
        Numbers of materials and of lights among the presets, 1 to 64.
    step : int
        Change of the angle's code from one frame to the next, 1 to 4095.
    first : int
        Code of the angle before the first frame, 0 to 4095.
    debounce_bits : int
        Bits of the counter of cycles between two samples, 1 to 24. The default is 10 ms at 52 MHz.

    Raises
    ------
    ValueError
        If a number is out of range.

    Source: docs/theory/video.md#bands; not in the documents.
    """

    materials: int = 1
    lights: int = 1
    step: int = 8
    first: int = 0
    debounce_bits: int = 19

    def __post_init__(self) -> None:
        for name, low, high in (
            ("materials", 1, 64),
            ("lights", 1, 64),
            ("step", 1, (1 << ANGLE_BITS) - 1),
            ("first", 0, (1 << ANGLE_BITS) - 1),
            ("debounce_bits", 1, 24),
        ):
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} must be {low} to {high}, not {getattr(self, name)!r}")

    @property
    def start(self) -> ControlState:
        """State before the first frame."""
        return ControlState(angle=self.first)

    def press(self, state: ControlState, button: str) -> ControlState:
        """State after a press of one of `BUTTONS`."""
        if button == "pause":
            return replace(state, running=not state.running)
        if button == "step":
            if state.running:
                return replace(state, backwards=not state.backwards)
            return replace(state, angle=self._turned(state))
        if button == "material":
            return replace(state, material=(state.material + 1) % self.materials)
        return replace(state, light=(state.light + 1) % self.lights)

    def advance(self, state: ControlState) -> ControlState:
        """State of the next frame."""
        return replace(state, angle=self._turned(state)) if state.running else state

    def list_of(self, state: ControlState) -> int:
        """Index of the list of commands for a state."""
        return state.light * self.materials + state.material

    def _turned(self, state: ControlState) -> int:
        step = -self.step if state.backwards else self.step
        return (state.angle + step) % (1 << ANGLE_BITS)
