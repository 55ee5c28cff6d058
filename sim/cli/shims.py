"""What commands of other packages still import from `main`."""

import click

from blysk.golden.pipeline import STYLES
from blysk.golden.presets import METHODS, PUBLISHED
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.sim.api.design import design
from blysk.sim.value_types import Choice, OutputFile, Size, Whole

__all__ = ["Choice", "OutputFile", "Settings", "Size", "Whole", "chosen_design", "design_options"]

_OPERANDS = {"dot": "cosine", "chord": "one_minus_cosine", None: None}

Settings = dict


def chosen_design(settings, lights):
    """The pipeline of `design_options`."""
    settings = dict(settings)
    return design(lights=lights, operand=_OPERANDS[settings.pop("highlight")], **settings)


def design_options(command):
    """Options of a design, with defaults."""
    for option in (
        click.option("--style", type=Choice("style", STYLES), default="throughput"),
        click.option("--setup-interval", type=Whole(1, 46)),
        click.option("--gate/--no-gate", default=False),
        click.option("--highlight", type=Choice("form", ("dot", "chord"))),
        click.option("--model", type=Choice("reflection model", REFLECTION_MODELS), default="cosquad"),
        click.option("--method", type=Choice("method", METHODS | PUBLISHED), default="chord"),
    ):
        command = option(command)
    return command
