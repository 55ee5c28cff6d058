"""Records of units, and the runs that tests and tools make from them.

A record is in the file of the unit's name in `blysk.bench.units`. Tables, pages, tests of the RTL, mutants,
toggle coverage, other simulators and baselines iterate over `registry.RECORDS`. No other list of units
exists. To add a unit, write its model in `golden`, its component in `hdl`, its record, and a test of its
special features.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Any
from weakref import ref

import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.units.sample import Sample

__all__ = [
    "OFFERED",
    "PAUSED",
    "STALLS",
    "TAKEN",
    "Beats",
    "Case",
    "Record",
    "Stimulus",
    "UnitRun",
    "Variant",
    "first",
    "length_of",
    "once",
    "together",
]

Beats = np.ndarray | Mapping[str, Any]
"""Beats of a stream: a structured array, or (nested) mappings of field names to arrays of codes."""

PAUSE, PAUSED = 61, 40
"""Cycles from an input beat to the next, and number of input beats, in the run with pauses.

This run is the last run of a stimulus.
"""

STALLS = ((0.0, 0.0), (0.4, 0.4), (0.9, 0.1), (0.1, 0.9))
"""Share of cycles with a stalled input, and share of cycles with a stalled output, for each run."""

OFFERED, TAKEN = 2.0, 0.6
"""Rates of offered and of taken beats in the run whose stalls end, relative to the run without stalls.

The sink takes 0.6 of the full rate. So it stalls a unit at full rate, and no unit at half of its rate. A unit
that has fallen to half of its rate stays there, and a test sees it after the stalls.
"""


@dataclass(frozen=True)
class Variant:
    """A variant of a unit: how to make its component, and how to measure its errors.

    Parameters
    ----------
    unit : callable
        Makes the component. Its ``model`` is the bit-accurate model.
    measure : callable, optional
        Function from a random generator and a number of samples to a `Sample`. In units that take whole
        spans, a sample is a pixel. ``None``: the variant is in no table of errors.
    domain : str
        Operands for which errors are measured.
    scale : str
        Unit of the errors: ``rad``, ``turn``, ``LSB``, ``rate`` (a share of the decisions) or empty. If it is
        empty, 1 is a full term or the length of a vector.
    exhaustive : bool
        Whether every operand of the domain is measured, for any number of samples.
    beat : dict
        Fields of the input beats of a simulation. The simulation finds latency and interval if the unit does
        not state them. Other fields are 0.
    note : str
        Further remark.
    source : str
        Document and figure, if they differ from those of the record.
    as_published : bool
        Whether the constants or the form are those that a document prints.
    long : bool
        Whether its RTL is simulated in the long run only.
    """

    unit: Callable[[], Component]
    measure: Callable[[np.random.Generator, int], Sample] | None = None
    domain: str = ""
    scale: str = ""
    exhaustive: bool = False
    beat: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    source: str = ""
    as_published: bool = False
    long: bool = False


@dataclass(frozen=True)
class Case:
    """Input of a unit for one run.

    Parameters
    ----------
    beats : Beats
        Input beats.
    constants : Beats, optional
        Constants for the whole run, if the unit has a port ``constants``.
    write : Beats, optional
        Beats of the stream ``write``.
    write_after : array, shape (writes,), optional
        Number of input beats before each write, in ascending order. ``None``: all writes come before the
        first beat.
    """

    beats: Beats
    constants: Beats | None = None
    write: Beats | None = None
    write_after: np.ndarray | None = None

    @property
    def sent(self) -> dict[str, Any]:
        """Arguments of `simulate` for constants and writes."""
        return {name: getattr(self, name) for name in ("constants", "write", "write_after")}

    def first(self, count: int) -> "Case":
        """The first input beats, and the writes up to the last of these beats."""
        few = replace(self, beats=first(self.beats, count))
        if self.write_after is None:
            return few
        writes = int(np.count_nonzero(self.write_after < count))
        return replace(few, write=first(self.write, writes), write_after=self.write_after[:writes])


@dataclass(frozen=True)
class Stimulus:
    """A kind of input for a unit. The docstring of its function in the record says what the input covers.

    Parameters
    ----------
    make : callable
        Function from the component, a random generator and a number of beats or pixels to a `Case`. The first
        paragraph of its docstring describes the covered inputs in a sentence or two.
    count : int
        Number of beats or pixels in a test.
    stalled : bool
        Whether the stimulus is sent with all stalls of `STALLS`. Else it is sent only without stalls.
    pace : callable, optional
        Function from the component to the documented cycles from an output beat to the next, for this input
        without stalls. ``None`` if they depend on the data. After stalls, tests compare the cycles
        with the run without stalls and with this pace. A `PipelinedUnit` needs none: it has an interval.
    long : bool
        Whether the stimulus belongs to the long run.
    repeats : int
        Number of times that the stimulus is made, each time with another seed.
    variants : tuple of str
        Names of the variants for which the stimulus is made. Empty: all variants.
    """

    make: Callable[[Component, np.random.Generator, int], Case]
    count: int = 1000
    stalled: bool = True
    pace: Callable[[Component], float] | None = None
    long: bool = False
    repeats: int = 1
    variants: tuple[str, ...] = ()

    @property
    def covers(self) -> str:
        """Description of the covered inputs, in a sentence or two."""
        make = getattr(self.make, "func", self.make)
        return (make.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ")


@dataclass(frozen=True)
class UnitRun:
    """A run of a unit: input, expected output, stalls.

    Parameters
    ----------
    case : Case
        Input.
    expected : Beats
        Output beats of the bit-accurate model.
    status : dict or None
        Expected members of the status after the run, see `Record.status`.
    stalls : dict
        Arguments ``input_stalls`` and ``output_stalls`` of `simulate`. Empty: no stalls.
    settles : bool
        Whether a test ends the stalls half-way, with `settled`. It needs the times without stalls.
    """

    case: Case
    expected: Beats
    status: Mapping[str, int] | None
    stalls: dict[str, np.ndarray]
    settles: bool = False

    @property
    def count(self) -> int:
        """Number of output beats."""
        return length_of(self.expected)

    def settled(self, cycles: np.ndarray, input_cycles: np.ndarray) -> tuple["UnitRun", int]:
        """The run with stalls on both sides for the first half of the beats, and without stalls after it.

        Parameters
        ----------
        cycles, input_cycles : arrays
            Clock of each output beat, and of each input beat, in the run without stalls.

        Returns
        -------
        run : UnitRun
            The run. `OFFERED` and `TAKEN` give the rates during the stalls.
        end : int
            Clock from which there are no stalls.
        """
        rng, start = np.random.default_rng([2026, len(cycles)]), int(input_cycles[0])
        span = int(max(cycles.max(initial=0), input_cycles[-1])) + 1 - start
        end = start + round(span / 2 / TAKEN)
        # Patterns of stalls repeat. A run that keeps its rate ends before the repetition.
        free = np.zeros(end + 2 * span + 1000, dtype=bool)
        offered = min(OFFERED * len(input_cycles) / span, 0.9)
        taken = TAKEN * min(len(cycles) / span, 1)
        stalls = {
            name: np.concatenate([rng.random(end) >= share, free])
            for name, share in (("input_stalls", offered), ("output_stalls", taken))
        }
        return replace(self, stalls=stalls), end


@dataclass(frozen=True)
class Record:
    """Facts about a unit that tools and tests need.

    Parameters
    ----------
    name : str
        Name of its files in `golden` and `hdl`.
    title : str
        The unit's result, in a few words.
    source : str
        Document and figure.
    variants : dict
        Variants by name. The first variant is the default. Mutants and toggle coverage use the default.
    expect : callable
        Function from the component and a `Case` to the output beats by the bit-accurate model.
    stimuli : dict
        Stimuli by name. The first stimulus takes any number of beats. Other simulators use it, too.
    status : callable, optional
        Function from the component and a `Case` to the expected members of the port ``status`` after a run,
        by name. A component without this port has the ports ``out_of_range`` and ``wide``. The function then
        gives the number of cycles on which each of these ports is high.
    axis : str
        Quantity on the axis of a drawing of errors. Empty: no drawing.
    logarithmic : bool
        Whether this axis is logarithmic.
    waivers : dict
        Reasons by name of a signal of the default variant. A reason says why a fault of this signal may
        survive, or which test finds the fault. A fault may set a bit to 0 or 1, or invert it. Some faults
        invert a bit only while another bit of the same word, the *controlling bit*, has a certain value.
    still : dict
        Register bits of the default variant that cannot toggle. The key is the reason. The value lists
        signals with their bits.
    remembers : bool
        Whether the unit has a memory of earlier beats that a reset does not clear.
    """

    name: str
    title: str
    source: str
    variants: Mapping[str, Variant]
    expect: Callable[[Component, Case], Beats]
    stimuli: Mapping[str, Stimulus]
    status: Callable[[Component, Case], Mapping[str, int]] | None = None
    axis: str = "angle of the span, degrees"
    logarithmic: bool = False
    waivers: Mapping[str, str] = field(default_factory=dict)
    still: Mapping[str, str] = field(default_factory=dict)
    remembers: bool = False

    @property
    def default(self) -> str:
        """Name of the default variant."""
        return next(iter(self.variants))

    @cached_property
    def kind(self) -> type[Component]:
        """Class of the component."""
        unit = self.variants[self.default].unit
        return getattr(unit, "func", unit)

    def source_of(self, variant: str) -> str:
        """Document and figure of a variant."""
        return self.variants[variant].source or self.source

    def stimuli_of(self, variant: str) -> dict[str, Stimulus]:
        """Stimuli for a variant."""
        return {
            name: stimulus
            for name, stimulus in self.stimuli.items()
            if not stimulus.variants or variant in stimulus.variants
        }

    def example(self, variant: str, unit: Component, results: int = 3) -> UnitRun:
        """A short run of a variant's first stimulus. It shows the unit's latency and interval.

        Parameters
        ----------
        variant : str
            Name of the variant.
        unit : Component
            Component of this variant.
        results : int
            Least number of output beats. A stimulus of 200 beats is the longest run, so it may give fewer.
        """
        make = next(iter(self.stimuli_of(variant).values())).make
        case = make(unit, np.random.default_rng(2026), 200)
        for count in (results, 2 * results, 4 * results, 8 * results, PAUSED, length_of(case.beats)):
            few = case.first(count)
            expected = self.expect(unit, few)
            if length_of(expected) >= results:
                break
        return UnitRun(few, expected, None, {})

    def runs(self, unit: Component, stimulus: str, seed: int = 2026) -> Iterator[UnitRun]:
        """The runs of a stimulus: without stalls, with stalls, and with pauses.

        The same seed gives the same runs. The second run settles, see `UnitRun`.

        Parameters
        ----------
        unit : Component
            Component of one of the variants.
        stimulus : str
            Name of the stimulus.
        seed : int
            Seed of the random generator.
        """
        given = self.stimuli[stimulus]
        for repeat in range(given.repeats):
            rng = np.random.default_rng([seed, *stimulus.encode(), repeat])
            case = given.make(unit, rng, given.count)
            expected, status = self.expect(unit, case), self._status(unit, case)
            for shares in STALLS if given.stalled else STALLS[:1]:
                names = ("input_stalls", "output_stalls")
                periods = (997, 1009)
                stalls = {
                    name: rng.random(period) < share
                    for name, period, share in zip(names, periods, shares, strict=True)
                    if share
                }
                yield UnitRun(case, expected, status, stalls, shares == STALLS[1])
            if given.stalled:
                few = case.first(PAUSED)
                pauses = np.arange(PAUSE * PAUSED) % PAUSE != 0
                stalls = {"input_stalls": pauses}
                yield UnitRun(few, self.expect(unit, few), self._status(unit, few), stalls)

    def _status(self, unit: Component, case: Case) -> Mapping[str, int] | None:
        return None if self.status is None else self.status(unit, case)


def first(beats: Beats, count: int) -> Beats:
    """The first beats of a (nested) mapping of arrays."""
    if isinstance(beats, Mapping):
        return {name: first(value, count) for name, value in beats.items()}
    return beats[:count]


def length_of(beats: Beats) -> int:
    """Number of beats."""
    return length_of(next(iter(beats.values()))) if isinstance(beats, Mapping) else len(beats)


def together(parts: Sequence[Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Beats of several mappings with the same fields, one mapping after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def once(compute: Callable[[Component, Case], Any]) -> Callable[[Component, Case], Any]:
    """A function of a unit and a case that keeps its last result while the case exists.

    A test needs output and status of a case one after the other. Both come from the same call of the model.
    """
    kept: dict[str, Any] = {}

    @wraps(compute)
    def computed(unit: Component, case: Case) -> Any:
        if not kept or kept["case"]() is not case or kept["unit"]() is not unit:
            kept.update(result=compute(unit, case), case=ref(case), unit=ref(unit))
        return kept["result"]

    return computed
