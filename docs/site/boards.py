"""Write the page of a release about its bitstreams: what you should see, and how to report it.

python docs/site/boards.py build/boards ulx3s-25f ulx3s-85f icepi-zero

``make boards`` makes the folder of each board, with the bitstream, the figures, and the first frame of the
simulated lanes. It then calls this script. The page becomes part of the documents.
"""

import argparse
import hashlib
import json
import os
import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import yaml

from blysk.bench.tools.boards import BOARDS
from blysk.golden.video.controls import Controls
from blysk.golden.video.display_timing import VGA
from blysk.golden.video.motion import ANGLE_BITS

PROJECT = Path(__file__).resolve().parents[2]
FORM = PROJECT / ".github" / "ISSUE_TEMPLATE" / "board.yml"

FIGURES, FRAME = "figures.json", "frame-0001.png"
"""Files of a board's folder: the record of ``blysk board``, and the first simulated frame."""

_HEAD = """\
# What you should see

The bitstreams of this release show a teapot that turns on a monitor. Load the bitstream of your board, and
compare the monitor with the picture of the board. No bitstream has been on a board so far. So please send
[a report](#to-report), also if everything is right.

## To load a bitstream

1. Compare the revision that is printed on your board with the table of the board, below. Other revisions may
   have the clock or the connector at other pins. They then show nothing.
2. Check the files in their folder: `sha256sum -c --ignore-missing SHA256SUMS`.
3. Install [openFPGALoader](https://trabucayre.github.io/openFPGALoader/guide/install.html).
   `openFPGALoader --list-boards` must list the name that stands after `-b` in the command of your board.
   Older versions do not know `icepi-zero`.
4. Connect the monitor to the board, then the board to the computer.
5. Run the command of your board, below. openFPGALoader writes the FPGA's memory. Without power the FPGA loses
   the bitstream.

## What to look for

- The monitor reports 640x480 and {rate} Hz.
- The mesh turns once in {seconds} seconds, without jumps. The picture of a board shows the first frame.
- Colours, highlight and background are as in the picture.
- No line and no band flickers, and none shows the background inside the mesh.
- The [buttons]({guide}#buttons) stop the mesh, turn it the other way, and change material and light.
- The picture is the same after ten minutes.

The guide lists [what only a board can show]({guide}#what-only-a-board-can-show).
"""

_BOARD = """\
## {name}

    openFPGALoader -b {loader} {file}

![The first frame of {name}: a teapot]({name}/{frame})

This frame was decoded from the simulated lanes of the monitor's connector. It equals the bit-accurate model
to the bit.

| | |
| --- | --- |
| file | `{file}`, {bytes:,} bytes |
| SHA-256 | `{digest}` |
| revisions of the board | {revisions} |
| mesh | {triangles} triangles |
| cycles a frame | {cycles:,} at {clock:g} MHz, {late} late bands |
{clocks}
"""

_FORM = """\
## To report

Copy this form into an issue of the repository from which you have the release. If the host of the repository
knows forms, choose *{name}* there. That form has the same questions.

```text
{form}
```
"""


def main(arguments: Sequence[str]) -> int:
    """Write the page. The exit status is 2 if a file of a board is missing."""
    parser = argparse.ArgumentParser(description="Write the page about the bitstreams of a release.")
    parser.add_argument("folder", type=Path, help="folder with a folder of each board, from `make boards`")
    parser.add_argument("boards", nargs="+", choices=BOARDS, help="boards of the release")
    given = parser.parse_args(arguments)
    guide = Path(os.path.relpath(PROJECT / "docs" / "guide" / "board.md", given.folder.resolve())).as_posix()
    rate = VGA.pixel_rate / VGA.cycles
    seconds = (1 << ANGLE_BITS) / Controls().step / rate
    try:
        parts = [_board(given.folder, name) for name in dict.fromkeys(given.boards)]
    except (OSError, KeyError, ValueError) as error:
        print(f"boards.py: {error}; run `make boards`", file=sys.stderr)
        return 2
    head = _HEAD.format(rate=f"{rate:.3g}", seconds=f"{seconds:.2g}", guide=guide)
    page = given.folder / "README.md"
    page.write_text("\n".join([head, *parts, form()]), encoding="utf-8")
    print(f"{'boards':<12}{page}")
    return 0


def _board(folder: Path, name: str) -> str:
    """Section of a board, from the files of its folder."""
    ((entry, figures),) = json.loads((folder / name / FIGURES).read_text(encoding="utf-8")).items()
    simulated, built = figures["simulated"], figures["built"]
    (file,) = (folder / name).glob("*.bit")
    content = file.read_bytes()
    if len(content) != built["bytes"] or not (folder / name / FRAME).is_file():
        raise ValueError(f"{folder / name}: bitstream, figures and frame are not of the same run")
    return _BOARD.format(
        name=name,
        loader=BOARDS[name].loader,
        file=file.name,
        frame=FRAME,
        bytes=len(content),
        digest=hashlib.sha256(content).hexdigest(),
        revisions=BOARDS[name].revisions,
        triangles=entry.split(", ")[-1].removesuffix(" triangles"),
        cycles=simulated["cycles"],
        clock=simulated["clock"],
        late=simulated["late_bands"],
        clocks="\n".join(_rows(built)),
    )


def _rows(built: dict) -> Iterator[str]:
    """Rows of parts and clocks."""
    for part, (used, most) in built["parts"].items():
        yield f"| {part} | {used:,} of {most:,} |"
    for name, clock in built["clocks"].items():
        yield f"| clock {name} | {clock['reached']:.1f} MHz, needed {clock['needed']:.1f} |"


def form() -> str:
    """Section with the questions of the form for hosts, as text to copy."""
    given = yaml.safe_load(FORM.read_text(encoding="utf-8"))
    lines = []
    for element in given["body"]:
        asked = element["attributes"]
        if element["type"] == "checkboxes":
            lines += [f"{asked['label']}:", *(f"[ ] {option['label']}" for option in asked["options"]), ""]
        elif element["type"] != "markdown":
            hint = asked.get("description", "") or "; ".join(asked.get("options", ()))
            lines += textwrap.wrap(f"{asked['label']} ({hint}):" if hint else f"{asked['label']}:", 88)
            lines.append("")
    return _FORM.format(name=given["name"], form="\n".join(lines).rstrip())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
