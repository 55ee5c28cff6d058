"""The scheduler, which places operations of a unit in time and on shared functional units.

The scheduler knows only operations, with the operands and the latency of each. It knows neither widths of
words nor Amaranth. `blysk.hdl.core.dataflow` describes the operations and makes registers of the schedule.

The scheduler guarantees, for every schedule:

- An operation reads its operands on a cycle on which all of them are there. Its result is not before its
  ``since``.
- Two uses of an instance of a functional unit never meet, in any two beats that the interval allows.
- A functional unit has as few instances as the interval allows, ``ceil(uses / interval)``. In a spaced
  schedule of operations that depend on each other, the search finds the number.
- The same operations in the same order give the same schedule.

Source: docs/theory/scheduling.md.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from math import prod

__all__ = ["Operation", "Placement", "Schedule", "place"]

_MOST_SEARCHED = 500
"""Largest number of ways to share instances that a spaced schedule tries."""


@dataclass(eq=False)
class Operation:
    """An operation, and its result.

    Parameters
    ----------
    name : str
        Name of the result.
    operands : tuple of Operation
        Operations whose results it reads, all on the same cycle.
    latency : int
        Cycles from the read of the operands to the first cycle on which the result can be read. 0 for wiring.
    lifetime : int or None
        Cycles on which the result can be read, before the next beat's result replaces it. ``None`` for
        wiring: the lifetime of its operand.
    resource : hashable or None
        Functional unit that serves it: equal instances of hardware, shared by its uses. ``None``: hardware of
        its own.
    since : int or Operation
        Earliest stage of the result, as a number, or as the stage of another operation's result. If a result
        is made late and read late, it needs no copies.
    """

    name: str
    operands: tuple["Operation", ...]
    latency: int
    lifetime: int | None
    resource: Hashable | None = None
    since: "int | Operation" = 0


@dataclass(frozen=True)
class Placement:
    """Place of an operation: the stage at which it reads its operands, and its instance.

    Parameters
    ----------
    read : int
        Enabled cycles from the input of a beat to the read of the operands.
    instance : int
        Number of the functional unit's instance; 0 without a functional unit.
    """

    read: int
    instance: int = 0


@dataclass(frozen=True)
class Schedule:
    """Operations in time and on instances.

    Parameters
    ----------
    placements : dict of Operation to Placement
        Placement of every operation.
    counts : dict
        Instances of each functional unit.
    """

    placements: Mapping[Operation, Placement]
    counts: Mapping[Hashable, int]

    def stage(self, operation: Operation) -> int:
        """First stage at which the result can be read."""
        return self.placements[operation].read + operation.latency

    @property
    def length(self) -> int:
        """First stage at which all results can be read."""
        return max(map(self.stage, self.placements))


def place(operations: Sequence[Operation], interval: int, spaced: bool = False) -> Schedule:
    """Place each operation at the earliest stage that has its operands and a free slot.

    Beats come a whole multiple of the interval apart, so an instance has as many slots as the interval has
    cycles. In a *spaced* schedule beats come any number of cycles apart, from the interval on. The uses of an
    instance then lie within as many stages as the interval has cycles.

    Then operations with hardware of their own move to the latest stage that needs no further copy of an
    operand. An operand is there for its lifetime, and until the last other operation has read it.

    Parameters
    ----------
    operations : sequence of Operation
        Operations, each after its operands.
    interval : int
        Initiation interval, at least 1.
    spaced : bool
        Whether beats may come any number of cycles apart, from the interval on.

    Returns
    -------
    schedule : Schedule
        Schedule of all operations.
    """
    resources = list(dict.fromkeys(o.resource for o in operations if o.resource is not None))
    found = _greedy(operations, interval, spaced)
    if spaced and interval > 1:
        found = min((found, *_shared(operations, interval, resources)), key=_size)
    return Schedule(_delayed(operations, found.placements), found.counts)


def _earliest(operation: Operation, placements: dict) -> int:
    """First stage at which an operation may read its operands."""
    since = operation.since
    if isinstance(since, Operation):
        since = placements[since].read + since.latency
    stages = [placements[o].read + o.latency for o in operation.operands]
    if not operation.latency:
        return max(stages, default=since)
    return max([since - operation.latency, *stages])


def _greedy(operations: Sequence[Operation], interval: int, spaced: bool) -> Schedule:
    """Put each use at the first free slot. If no slot is free within two intervals, add an instance."""
    placements: dict[Operation, Placement] = {}
    instances: dict[Hashable, list[set[int]]] = {}
    for resource in (o.resource for o in operations if o.resource is not None):
        instances.setdefault(resource, [])
    for resource, taken in instances.items():
        uses = sum(o.resource == resource for o in operations)
        taken += [set() for _ in range(-(-uses // interval))]

    def serves(taken: set[int], stage: int) -> bool:
        if spaced:
            return stage not in taken and max(taken | {stage}) - min(taken | {stage}) < interval
        return all((stage - other) % interval for other in taken)

    for operation in operations:
        read, instance = _earliest(operation, placements), 0
        if operation.resource is not None:
            sets = instances[operation.resource]
            slots = (
                (stage, k)
                for stage in range(read, read + 2 * interval)
                for k, taken in enumerate(sets)
                if serves(taken, stage)
            )
            slot = next(slots, None)
            if slot is None:
                sets.append(set())
                slot = read, len(sets) - 1
            read, instance = slot
            sets[instance].add(read)
        placements[operation] = Placement(read, instance)
    return Schedule(placements, {resource: len(taken) for resource, taken in instances.items()})


def _size(schedule: Schedule) -> tuple[int, int]:
    """Size of a schedule for comparisons: first the number of instances, then the length."""
    return sum(schedule.counts.values()), schedule.length


def _shared(
    operations: Sequence[Operation], interval: int, resources: Sequence[Hashable]
) -> Iterator[Schedule]:
    """Spaced schedules with few instances. If there are too many ways to search, there are no schedules.

    The uses of a functional unit, sorted by their earliest stage, are divided into runs of neighbours. Each
    run has an instance. The first uses of a run wait until all its uses lie within the interval.
    """
    alone: dict[Operation, Placement] = {}
    for operation in operations:
        alone[operation] = Placement(_earliest(operation, alone))
    uses = {
        resource: sorted((o for o in operations if o.resource == resource), key=lambda o: alone[o].read)
        for resource in resources
    }
    choices = [list(islice(_runs(len(uses[resource]), interval), _MOST_SEARCHED)) for resource in resources]
    if prod(map(len, choices)) >= _MOST_SEARCHED:
        return
    fewest = None
    for chosen in product(*choices):
        instances = sum(map(len, chosen))
        if fewest is not None and instances > fewest:
            continue
        run_of = {}
        for resource, sizes in zip(resources, chosen, strict=True):
            of_resource = iter(uses[resource])
            for k, size in enumerate(sizes):
                run_of.update({next(of_resource): (resource, k) for _ in range(size)})
        placements = _windows(operations, interval, run_of)
        if placements is None:
            continue
        counts = {resource: len(sizes) for resource, sizes in zip(resources, chosen, strict=True)}
        fewest = instances
        yield Schedule(placements, counts)


def _runs(uses: int, interval: int) -> Iterator[tuple[int, ...]]:
    """Sizes of the runs of neighbours: first with the fewest runs, then with one or two more runs."""

    def parts(left: int, count: int) -> Iterator[tuple[int, ...]]:
        if count == 0:
            if left == 0:
                yield ()
            return
        # Each other run takes at least one use, and at most `interval` uses.
        for size in range(min(interval, left - count + 1), max(1, left - interval * (count - 1)) - 1, -1):
            for rest in parts(left - size, count - 1):
                yield size, *rest

    fewest = -(-uses // interval)
    for count in range(fewest, min(uses, fewest + 2) + 1):
        yield from parts(uses, count)


def _windows(
    operations: Sequence[Operation], interval: int, run_of: dict[Operation, tuple]
) -> dict[Operation, Placement] | None:
    """Placements in which the uses of each run lie within an interval. ``None`` if there is no placement."""
    starts: dict[tuple, int] = dict.fromkeys(run_of.values(), 0)
    for _ in range(2 * len(operations)):
        placements: dict[Operation, Placement] = {}
        taken: dict[tuple, set[int]] = {run: set() for run in starts}
        for operation in operations:
            read, run = _earliest(operation, placements), run_of.get(operation)
            if run is None:
                placements[operation] = Placement(read)
                continue
            read = max(read, starts[run])
            while read in taken[run]:
                read += 1
            taken[run].add(read)
            placements[operation] = Placement(read, run[1])
        late = {run: max(stages) - interval + 1 for run, stages in taken.items()}
        if all(min(taken[run]) >= least for run, least in late.items()):
            return placements
        if max(late.values()) > 40 * interval + 400:
            return None
        starts = {run: max(starts[run], least) for run, least in late.items()}
    return None


def _delayed(
    operations: Sequence[Operation], placements: dict[Operation, Placement]
) -> dict[Operation, Placement]:
    """Move operations with hardware of their own to the latest stage that needs no copy of an operand."""
    placements = dict(placements)
    readers: dict[Operation, list[Operation]] = {o: [] for o in operations}
    for operation in operations:
        for operand in dict.fromkeys(operation.operands):
            readers[operand].append(operation)
    bound = {o.since for o in operations if isinstance(o.since, Operation)}
    for operation in reversed(operations):
        placement = placements[operation]
        fixed = operation.resource is not None or not operation.latency or operation in bound
        if fixed or not readers[operation] or not operation.operands:
            continue
        # Wiring has the stage of its operand. So operations before or behind wiring do not move.
        if any(not o.latency and o.operands for o in (*readers[operation], *operation.operands)):
            continue
        latest = min(placements[o].read for o in readers[operation]) - operation.latency
        for operand in operation.operands:
            others = (placements[o].read for o in readers[operand] if o is not operation)
            there = placements[operand].read + operand.latency
            latest = min(latest, max([there + (operand.lifetime or 1) - 1, *others]))
        if latest > placement.read:
            placements[operation] = Placement(latest, placement.instance)
    return placements
