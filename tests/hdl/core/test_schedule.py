"""The scheduler: stages and slots by hand; in random graphs two uses of an instance never meet."""

import numpy as np
import pytest

from blysk.hdl.core.schedule import Operation, place

INTERVALS = [1, 2, 3, 4, 5, 8, 11]


def operation(name, *operands, latency=1, lifetime=1, **options):
    return Operation(name, operands, latency, lifetime, **options)


def stages(operations, interval, **options):
    schedule = place(operations, interval, **options)
    return [schedule.stage(o) for o in operations]


def test_earliest_stages_by_hand():
    a, b = operation("a", latency=0, since=1), operation("b", latency=0, since=1)
    once = operation("once", a)
    both = operation("both", b, once)
    product = operation("product", once, both, latency=3, resource="multiplier")
    wire = operation("wire", product, latency=0)
    late = operation("late", wire, since=12)
    with_late = operation("with_late", a, since=late)
    words = [a, b, once, both, product, wire, late, with_late]
    assert stages(words, 3) == [1, 1, 2, 3, 6, 6, 12, 12]


def test_slots_by_hand():
    """With three uses of one instance the second and the third wait for a slot.

    Two instances have four slots.
    """
    a = operation("a", latency=0, lifetime=3, since=1)
    uses = [operation(f"use_{k}", a, latency=3, resource="multiplier") for k in range(3)]
    assert stages([a, *uses], 3) == [1, 4, 5, 6]
    assert place([a, *uses], 3).counts == {"multiplier": 1}
    assert stages([a, *uses], 2) == [1, 4, 4, 5]
    assert place([a, *uses], 2).counts == {"multiplier": 2}


def test_uses_wait_for_each_other_where_beats_come_at_any_distance():
    """The first of four uses waits for the second, so that two instances serve all four."""
    a = operation("a", latency=0, since=1)
    first = operation("first", a, latency=3, resource="shifter")
    chain = [operation("wait", a)]
    for k in range(5):
        chain.append(operation(f"wait_{k}", chain[-1]))
    uses = [operation(f"use_{k}", chain[k + 1], latency=3, resource="shifter") for k in (1, 3, 4)]
    words = [a, first, *chain, *uses]
    schedule = place(words, 2, spaced=True)
    assert schedule.counts == {"shifter": 2}
    assert schedule.stage(first) == schedule.stage(uses[0]) - 1 == 6
    check(words, schedule, 2, spaced=True)


def test_operations_with_hardware_of_their_own_come_late():
    """An operation comes later only if its operands are there later anyway, so that it needs no copy."""
    a = operation("a", latency=0, lifetime=1, since=0)
    b = operation("b", latency=0, lifetime=1, since=0)
    early, kept = operation("early", a), operation("kept", b)
    last = operation("last", a, since=9)
    end = operation("end", early, kept, last)
    schedule = place([a, b, early, kept, last, end], 1)
    assert [schedule.stage(o) for o in (early, kept, last, end)] == [9, 1, 9, 10]


def random_operations(rng, interval):
    words = [operation(f"input_{k}", latency=0, lifetime=interval, since=int(interval > 1)) for k in range(3)]
    for k in range(int(rng.integers(3, 25))):
        operands = [words[i] for i in rng.integers(len(words), size=rng.integers(1, 3))]
        kind = rng.choice(["use", "use", "other", "register", "wire"])
        since = int(rng.integers(30)) if rng.random() < 0.1 else 0
        if kind == "wire":
            words.append(Operation(f"{kind}_{k}", tuple(operands[:1]), 0, operands[0].lifetime))
        elif kind == "register":
            words.append(operation(f"{kind}_{k}", *operands, lifetime=interval, since=since))
        else:
            latency = {"use": 3, "other": 4}[kind]
            words.append(
                operation(f"{kind}_{k}", *operands, latency=latency, resource=str(kind), since=since)
            )
    return words


def check(words, schedule, interval, spaced):
    """Check the guarantees of the scheduler, for each beat and cycle."""
    for word in words:
        placement = schedule.placements[word]
        for operand in word.operands:
            assert placement.read >= schedule.stage(operand)
        assert schedule.stage(word) >= (word.since if isinstance(word.since, int) else 0)
    span = schedule.length + interval
    distances = range(interval, span) if spaced else range(interval, span, interval)
    for resource, count in schedule.counts.items():
        uses = [schedule.placements[o] for o in words if o.resource == resource]
        assert {p.instance for p in uses} <= set(range(count))
        for instance in range(count):
            taken = [p.read for p in uses if p.instance == instance]
            assert len(set(taken)) == len(taken)
            assert not {a - b for a in taken for b in taken} & set(distances)


@pytest.mark.parametrize("spaced", [False, True])
@pytest.mark.parametrize("interval", INTERVALS)
def test_guarantees_hold_of_random_graphs(interval, spaced):
    rng = np.random.default_rng(interval)
    for _ in range(6):
        words = random_operations(rng, interval)
        schedule = place(words, interval, spaced)
        check(words, schedule, interval, spaced)
        assert schedule.placements == place(words, interval, spaced).placements
        if not spaced:
            for resource, count in schedule.counts.items():
                assert count == -(-sum(o.resource == resource for o in words) // interval)
