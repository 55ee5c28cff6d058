"""Designs of a sweep of the design space, and the choices that they combine."""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, NamedTuple, get_args

from blysk.golden.build import LANES, STYLES
from blysk.golden.methods.interpolator import Operand
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS, PUBLISHED, preset

if TYPE_CHECKING:
    from blysk.hdl.pipeline import ShadingPipelineUnit

__all__ = ["COSTS", "DEGREES", "OPERANDS", "SERVED", "WORDS", "Candidate", "Sweep"]

COSTS = {
    "cells": "cells",
    "multipliers": "multipliers",
    "registers": "register_bits",
    "memory": "memory_bits",
}
"""Names of the costs, with their figures in `Cost.totals`."""

OPERANDS = get_args(Operand)
"""Operands of the specular unit."""


SERVED = LOBES | MIRROR_LOBES | MODELS
"""Specular units by reflection model. A model with a roughness takes the roughness that fits the exponent."""

DEGREES = sorted({degree for of in METHODS.values() for degree in of.degrees})
"""Degrees that polynomials of methods can have."""

WORDS = sorted({bits for of in METHODS.values() for bits in of.word_choices})
"""Fraction bits that words of methods can have."""


@dataclass(frozen=True)
class Candidate:
    """A design of the sweep.

    Parameters
    ----------
    method, model, lights, operand
        See `ShadingPipeline`.
    degree : int, optional
        Degree of the method's polynomial in the angle. ``quadratic`` and its forms have a polynomial for the
        middle normal, of degree 2 (a plain minimax fit) or 3. ``bisection`` has a polynomial for its factor,
        of degree 1 or 2.
    fraction_bits : int, optional
        Fraction bits of the differences of ``chord-local``.
    style : str
        See `ShadingPipelineUnit`.
    lanes : int
        Lanes of the pipeline. Several lanes need the throughput style.

    Raises
    ------
    ValueError
        If the combination is impossible.
    """

    method: str
    model: str = "cosquad"
    lights: int = 1
    operand: Operand | None = None
    degree: int | None = None
    fraction_bits: int | None = None
    style: str = "throughput"
    lanes: int = 1

    def __post_init__(self):
        _ = self.design

    @cached_property
    def design(self) -> ShadingPipeline:
        """The design's `ShadingPipeline`, the bit-accurate model of the pipeline."""
        usual = preset(self.method, self.model, self.lights, operand=self.operand, style=self.style)
        interpolator = usual.interpolator
        if interpolator.needs_table and self.model in MODELS:
            raise ValueError(f"method {self.method} serves only models that come from a table")
        if self.fraction_bits is not None:
            interpolator = interpolator.with_words(self.fraction_bits)
        if self.degree is not None:
            interpolator = interpolator.with_degree(self.degree)
        return replace(usual, interpolator=interpolator).built(lanes=self.lanes)

    def unit(self) -> "ShadingPipelineUnit":
        """The design's hardware."""
        # This import takes a second, and listing a sweep does not need it.
        from blysk.hdl.pipeline import ShadingPipelineUnit

        return ShadingPipelineUnit(self.design)

    @property
    def command(self) -> str:
        """Shell command that prints the design as Verilog."""
        usual = preset(self.method, self.model, operand=self.operand).interpolator.for_lanes(self.lanes)
        if self.method in METHODS and self.design.interpolator == usual:
            words = ["blysk", "verilog", "--method", self.method, "--model", self.model]
            words += ["--lights", str(self.lights)] if self.lights != 1 else []
            words += ["--operand", self.operand] if self.operand else []
            words += ["--style", self.style] if self.style != "throughput" else []
            words += ["--lanes", str(self.lanes)] if self.lanes > 1 else []
            return shlex.join([*words, "--transfer", self.design.transfer])
        given = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        # JSON puts strings into double quotes. The shell's single quotes can then surround them.
        arguments = ", ".join(f"{name}={json.dumps(x)}" for name, (x, usual) in given.items() if x != usual)
        imports = "from blysk.bench.tools.sweep import Candidate; from blysk.hdl.emit.verilog import emit"
        return shlex.join(["python", "-c", f'{imports}; print(emit(Candidate({arguments}).unit(), "blysk"))'])


class Sweep(NamedTuple):
    """Values to combine in all ways. If a method does not have a parameter, the parameter is not varied.

    Parameters
    ----------
    methods, models, lights, operands, degrees, fraction_bits, styles, lanes : sequences
        See `Candidate`. Only the throughput style has several lanes.
    """

    methods: Sequence[str] = tuple(METHODS)
    models: Sequence[str] = ("blinn", "phong", "cosquad", "lyon3_refitted", "exp")
    lights: Sequence[int] = (1,)
    operands: Sequence[Operand | None] = OPERANDS
    degrees: Sequence[int] = (1, 2, 3)
    fraction_bits: Sequence[int] = (40, 46)
    styles: Sequence[str] = STYLES
    lanes: Sequence[int] = LANES

    def candidates(self) -> tuple[list[Candidate], dict[str, int]]:
        """Every design once, and the number of impossible combinations for each reason."""
        found: dict[Candidate, None] = {}
        refused: dict[str, list[str]] = {}
        for method in self.methods:
            of = (METHODS | PUBLISHED)[method]
            degrees = self.degrees if of.degrees else (None,)
            words = self.fraction_bits if of.word_choices else (None,)
            usual = of.operand
            operands = [None if operand == usual else operand for operand in self.operands]
            if usual not in OPERANDS:
                operands = [None]
            lanes = self.lanes if of.serves_lanes else (1,)
            built = [(s, n) for s, n in product(self.styles, lanes) if n == 1 or s == "throughput"]
            for *choices, build in product(self.models, self.lights, operands, degrees, words, built):
                values = *choices, *build
                try:
                    found[Candidate(method, *values)] = None
                except ValueError as error:
                    reason = str(error).removeprefix(f"method {method} ")
                    refused.setdefault(reason, []).append(method)
        reasons = {
            f"{', '.join(dict.fromkeys(methods))}: {reason}": len(methods)
            for reason, methods in refused.items()
        }
        return list(found), reasons
