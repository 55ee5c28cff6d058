"""Savings of the highlight gate: pixels, and cycles of the compact style.

``python -m blysk.bench.report.gate [MESH ...]`` renders each mesh (the teapot by default) at 320x240 with one
light. The method is quadratic, or another method that serves a gate (``--method``). The models are cosquad,
coscos4 and blinn_product, the exponents 2, 10, 50, 200 and 1000. There are frames in the compact and the
throughput style, without and with the gate. The command prints two tables in Markdown: gated spans and
pixels, and cycles.

The exit status is 1 if a frame of one of the four simulations differs by a bit from the frame of the
bit-accurate model. The exit status is 2 for bad input. The report's section `energy` has the gate's savings
of toggled register bits.

The methods quotient and renormalise have no gate, because their spans bring no unit normals.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass

import click
import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.accuracy import scene_for
from blysk.bench.command import progress, run
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.spans import pixels_of
from blysk.golden.pipeline import Pixels, ShadingPipeline, Spans
from blysk.golden.presets import METHODS as ALL_METHODS
from blysk.golden.presets import MODELS as ALL_MODELS
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Size

__all__ = [
    "EXPONENTS",
    "METHOD",
    "METHODS",
    "MODELS",
    "GateRow",
    "GateUnits",
    "Shares",
    "main",
    "measure",
    "shares_of",
]

METHODS = tuple(name for name, of in ALL_METHODS.items() if of.serves_gate and of.ORIGIN != "own")
"""Methods that serve the gate, because they have unit normals: linear, and the methods of the documents."""

METHOD = "quadratic"
"""Default method of `METHODS`."""

MODELS = ("cosquad", "coscos4", "blinn_product")
EXPONENTS = (2, 10, 50, 200, 1000)


@dataclass(frozen=True)
class Shares:
    """Spans and pixels of a frame that the gate keeps away from the specular unit, and upper limits of both.

    Parameters
    ----------
    spans, pixels : int
        Numbers of the frame. Spans of length 0 do not count.
    gated_spans, gated_pixels : int
        Spans that the gate finds dark, and their pixels.
    dark_spans, dark_span_pixels : int
        Spans without a specular term over 0, and their pixels. This is the limit of a gate for spans.
    dark_pixels : int
        Pixels whose specular term is 0. This is the limit of any gate.
    behind_pixels : int
        Pixels whose light is behind the surface. They are dark without a gate, too.
    """

    spans: int
    pixels: int
    gated_spans: int
    gated_pixels: int
    dark_spans: int
    dark_span_pixels: int
    dark_pixels: int
    behind_pixels: int


@dataclass(frozen=True)
class GateRow:
    """A frame without and with the gate. The first number of a pair is without the gate.

    Parameters
    ----------
    mesh, model : str
        Names of the mesh and the reflection model.
    exponent : int
        Exponent of the highlight.
    shares : Shares
        Gated and dark parts of the frame.
    cycles, compact_cycles : pair of int
        Cycles of the throughput and of the compact style, from the first write of a constant to the last
        pixel.
    identical : bool
        Whether the pixels of all four simulations equal the bit-accurate model, hidden pixels among them.
    """

    mesh: str
    model: str
    exponent: int
    shares: Shares
    cycles: tuple[int, int]
    compact_cycles: tuple[int, int]
    identical: bool


def shares_of(design: ShadingPipeline, spans: Spans, constants: FrameConstants) -> Shares:
    """Shares of a frame by the bit-accurate gate, for one light and material.

    The design itself may have no gate.
    """
    spans = spans[np.flatnonzero(spans.length)]
    length = np.asarray(spans.length, dtype=np.int64)
    operands = design.operands(spans, constants)
    behind = Diffuse(operands.cosine.format).dark(operands.cosine)
    dark = design.specular.compute(operands.highlight, behind, constants.exponent).codes[:, 0] == 0
    gated = ~design.lit_spans(spans, constants)[:, 0]
    span, _ = pixels_of(length)
    dark_span = np.bincount(span[~dark], minlength=len(length)) == 0
    return Shares(
        spans=len(length),
        pixels=int(length.sum()),
        gated_spans=int(gated.sum()),
        gated_pixels=int(length[gated].sum()),
        dark_spans=int(dark_span.sum()),
        dark_span_pixels=int(length[dark_span].sum()),
        dark_pixels=int(dark.sum()),
        behind_pixels=int(behind.sum()),
    )


def frames(
    units: Sequence[Component], spans: Spans, constants: FrameConstants, engine: str = "cxxrtl"
) -> list[Run]:
    """Simulate pipelines of one material, or toggle counters of such pipelines, with the same spans.

    Parameters
    ----------
    units : sequence of Component
        Pipelines.
    spans : Spans
        Input of each pipeline.
    constants : FrameConstants
        Constants that are written first.
    engine : str
        As `simulate` takes it.
    """
    count, write = int(np.sum(spans.length)), constants.writes()
    return [simulate(unit, beats_of(unit, spans), count=count, write=write, engine=engine) for unit in units]


def same_pixels(run: Run, expected: Pixels) -> bool:
    """Whether a run's pixels are as expected, in order: coordinates, colour, mark of a span's end."""
    fields = {name: getattr(expected, name) for name in ("x", "y", "last")}
    fields |= {name: expected.color[:, channel] for channel, name in enumerate("rgb")}
    return all(np.array_equal(run.beats[name], codes) for name, codes in fields.items())


class GateUnits:
    """The four pipelines of a model and a method, which serve every mesh and exponent.

    Parameters
    ----------
    model : str
        Reflection model.
    method : str
        One of `METHODS`.
    engine : str
        As `simulate` takes it.
    """

    def __init__(self, model: str, method: str = METHOD, engine: str = "cxxrtl"):
        self.model, self.engine = model, engine
        designs = [preset(method, model, gate=gate) for gate in (False, True)]
        self.design = designs[0]
        self._fast = [ShadingPipelineUnit(design) for design in designs]
        self._compact = [ShadingPipelineUnit(design.built(style="compact")) for design in designs]

    def compare(self, name: str, scene: Scene) -> GateRow:
        """Row of a scene of one light and one material, simulated by all four pipelines."""
        spans = prepare(scene, self.design).spans
        constants = FrameConstants.of(scene, 1)
        expected = self.design.compute(spans, constants)
        fast = frames(self._fast, spans, constants, self.engine)
        small = frames(self._compact, spans, constants, self.engine)
        return GateRow(
            mesh=name,
            model=self.model,
            exponent=constants.exponent,
            shares=shares_of(self.design, spans, constants),
            cycles=(fast[0].total_cycles, fast[1].total_cycles),
            compact_cycles=(small[0].total_cycles, small[1].total_cycles),
            identical=all(same_pixels(run, expected) for run in (*fast, *small)),
        )


def measure(
    meshes: Sequence,
    models: Sequence[str] = MODELS,
    exponents: Sequence[int] = EXPONENTS,
    width: int = 320,
    height: int = 240,
    method: str = METHOD,
    engine: str = "cxxrtl",
) -> Iterator[GateRow]:
    """Rows of every model, mesh and exponent.

    Parameters
    ----------
    meshes : sequence of blysk.sim.meshes.mesh.LoadedMesh
        The meshes.
    models, exponents : sequences
        Reflection models and exponents. An exponent is a frame constant, so it needs no further pipeline.
    width, height : int
        Size of a frame.
    method : str
        One of `METHODS`.
    engine : str
        As `simulate` takes it.
    """
    for model in models:
        units = GateUnits(model, method, engine)
        for loaded in meshes:
            for exponent in exponents:
                yield units.compare(loaded.name, scene_for(loaded.mesh, exponent, width, height))


def _share(part: int, whole: int) -> str:
    return f"{part / whole:.1%}" if whole else "-"


def _saved(off: int, on: int) -> str:
    return _share(off - on, off)


def _share_cells(row: GateRow) -> tuple[str, ...]:
    shares = row.shares
    pixels = (shares.gated_pixels, shares.dark_span_pixels, shares.dark_pixels, shares.behind_pixels)
    return (
        f"{shares.spans:,}",
        f"{shares.pixels:,}",
        _share(shares.gated_spans, shares.spans),
        *(_share(count, shares.pixels) for count in pixels),
    )


def _clock_cells(row: GateRow) -> tuple[str, ...]:
    pairs = (row.compact_cycles, row.cycles)
    return tuple(cell for pair in pairs for cell in (f"{pair[0]:,}", f"{pair[1]:,}", _saved(*pair)))


_TABLES: tuple[tuple[str, tuple[str, ...], Callable[[GateRow], tuple[str, ...]]], ...] = (
    (
        "Share of gated spans, then shares of pixels: in gated spans, in spans without a highlight, without "
        "a highlight, with the light behind the surface.",
        ("spans", "pixels", "gated spans", "gated", "in dark spans", "dark", "behind"),
        _share_cells,
    ),
    (
        "Cycles of the frame with the gate off and on, first in the compact, then in the throughput style.",
        ("off", "on", "saved", "off", "on", "saved"),
        _clock_cells,
    ),
)


def _print(rows: Sequence[GateRow]) -> None:
    for title, head, cells_of in _TABLES:
        click.echo(f"{title}\n")
        click.echo(f"| mesh | model | n | {' | '.join(head)} |")
        click.echo(f"|---|---|---:|{'---:|' * len(head)}")
        for row in rows:
            click.echo(f"| {' | '.join((row.mesh, row.model, str(row.exponent), *cells_of(row)))} |")
        click.echo()
    same = sum(row.identical for row in rows)
    click.echo(f"{same} of {len(rows)} frames are equal to the bit with the gate off and on.")


@click.command()
@click.argument("meshes", nargs=-1)
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default=METHOD,
    show_default=True,
    help="Method of interpolation along a span.",
)
@click.option("--size", type=Size(), default="320x240", show_default=True, help="Size of the frames.")
@click.option(
    "--model",
    "models",
    type=click.Choice(ALL_MODELS),
    multiple=True,
    default=MODELS,
    help="Model. Repeat for more.",
)
@click.option(
    "--exponent",
    "exponents",
    type=click.IntRange(1, MAX_EXPONENT),
    multiple=True,
    default=EXPONENTS,
    help="Exponent. Repeat for more.",
)
@click.option("--json", "figures", type=click.Path(), help="JSON file with every figure.")
def _command(meshes, method, size, models, exponents, figures) -> int:
    """Measure the savings of the highlight gate: pixels and cycles."""
    if figures:
        check_writable(figures)
    loaded = [load_mesh(source, materials=False) for source in meshes or ["teapot"]]
    count = len(loaded) * len(models) * len(exponents)
    rows = list(progress(measure(loaded, models, exponents, *size, method), total=count, unit="frames"))
    if figures:
        settings = {"method": method, "width": size[0], "height": size[1]}
        write_json(figures, settings | {"frames": [asdict(row) for row in rows]})
    _print(rows)
    return 0 if all(row.identical for row in rows) else 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables, and compare the frames.

    Returns
    -------
    int
        Exit status: 0, or 1 if a frame differs or a simulation fails, 2 for bad input (printed in one line).
    """
    return run(_command, "blysk.bench.report.gate", arguments)


if __name__ == "__main__":
    sys.exit(main())
