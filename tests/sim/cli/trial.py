"""A program that tries malformed files and bad values of every option, one after the other.

``python trial.py FOLDER SEED COUNT EVERY`` tries ``COUNT`` files and every ``EVERY``-th option. Each is tried
in a forked process, which may take ten seconds of the processor, a minute in all, and a gibibyte more than at
its start. The program prints a line of JSON for each.
"""

import contextlib
import gc
import io
import json
import math
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import click
from good_files import good_files
from malformed import RENDER, Case, file_case, split

import blysk.sim.api.render
import blysk.sim.cli.main
import blysk.sim.cli.progress
from blysk.golden.frames.frame import model_frame
from blysk.sim.frames.frame import SimulatedFrame
from blysk.sim.value_types import OutputFile

MEMORY = 1 << 30

SECONDS = 10

PATIENCE = 60

_LONG = "x" * 10_000

_ODD = [*split("| |\n|a\nb|ż🫖|\udcff|\x1b[31m|x|None|--"), _LONG]

_BAD_NUMBERS = [*split("|nan|inf|-inf|1.5|1e3|0x10|٣|-1|1_0| 1|1\n"), "9" * 30, _LONG]

_BAD_VECTORS = split("|1,2|1,2,3,4|1,2,nan|inf,0,0|1e400,0,0|a,b,c|1;2;3|,,|1,,2|1\n2|1,2,3,|1,2,3,4,5|ż")

_BAD_COLORS = split("|#12345|#gggggg|#1234567|1,1|-0.1|1.1|nan|inf,0,0|red|1,1,1,1|1\n2")

_BAD_FILES = [*split(".|folder{0}|nowhere/a{0}|file/a{0}|a\n/b{0}|\udcff/b{0}"), "x" * 300 + "{0}"]

_BAD_FOLDERS = [*split("file|nowhere/folder|file/folder|a\n/b"), "x" * 300]

_BAD_MESHES = split("|.|..|/|folder|nowhere.obj|file|file/a.obj|/dev/zero|a\nb.obj|\udcff.obj|teapot/")

_BAD_MESHES += ["/proc/self/mem", "https://localhost/a.obj", "x" * 300 + ".obj", _LONG]

_BAD_ADDRESSES = [*split("|x|tcp://|http://a:1|a b:1|ż|a\nb|tcp://a:b|tcp://[x]:1"), _LONG]

_OF_TYPE = {
    "Whole": _BAD_NUMBERS,
    "_Count": _BAD_NUMBERS,
    "_Error": [*split("|nan|inf|0|-1|256|x|1,5|ż|1\n2"), _LONG],
    "Size": [*split("|16|16x|x12|0x0|-1x5|16x12x3|4096x1|1e3x5|16X12|nanx1|٣x٣"), _LONG],
    "Number": [*split("|x|nan|inf|-1|1,2|ż|1e999"), _LONG],
    "Vector": [*_BAD_VECTORS, "," * 5000, _LONG],
    "Color": [*_BAD_COLORS, _LONG],
    "Choice": [*_ODD, "1", "LINEAR", "linear,angular"],
    "_Some": [*_ODD, ",", "linear,,angular", "1.5", "17,x"],
    "Path": _BAD_FOLDERS,
    "BoolParamType": ["x", ""],
}

_OF_NAME = {
    # `blysk pages` makes its folder, and the folders above it.
    "folder": [*split("file|file/folder"), "x" * 300],
    "mesh": _BAD_MESHES,
    "meshes": _BAD_MESHES,
    "address": _BAD_ADDRESSES,
    "devices": _ODD,
    "name": split("| |\n|a\nb|ż🫖|\udcff|\x1b[31m|--|1a|a b|a-b"),
}

# An intensity of a light may be over 1. An axis has a name.
_GOOD = {"ambient_light": "1.1", "up": "x"}

_SUFFIXES = {"output": ".png", "comparison": ".png", "figures": ".json", "vcd": ".vcd"}


def _bad_values(option: click.Parameter) -> list[str]:
    if option.name in _SUFFIXES:
        values = [value.format(_SUFFIXES[option.name]) for value in _BAD_FILES]
        return ["", *values] if isinstance(option.type, OutputFile) else values
    values = _OF_NAME.get(option.name) or _OF_TYPE.get(type(option.type).__name__, _ODD)
    return [value for value in values if value != _GOOD.get(option.name)]


def option_cases() -> Iterator[Case]:
    """Bad values of every option and argument of every command."""
    files = {"file": b"x", "folder": None, **{f"folder{suffix}": None for suffix in _SUFFIXES.values()}}
    context = click.Context(blysk.sim.cli.main.cli)
    for word in blysk.sim.cli.main.cli.list_commands(context):
        command = blysk.sim.cli.main.cli.get_command(context, word)
        begin = [word, "teapot"] if word == "render" else [word]
        for option in command.params:
            for value in _bad_values(option):
                if isinstance(option, click.Option):
                    arguments = [*begin, f"{max(option.opts, key=len)}={value}"]
                else:
                    arguments = [word, "--", value]
                name = f"{word} {option.opts[0]} {value[:20]!r}"
                yield Case(name, arguments, files, must_fail=True)
        for wrong in (["--nothing"], ["--no\nthing"], ["--json"], ["one", "two", "three"]):
            yield Case(f"{word} {wrong[0]!r}", [*begin, *wrong], files, must_fail=True)
    for value in [*_ODD, "-x", "--no\nthing"]:
        yield Case(f"command {value[:20]!r}", [value], files, must_fail=True)


def _put(folder: Path, files: dict[str, Any]) -> None:
    for name, content in files.items():
        path = folder / name
        if content is None:
            path.mkdir()
        elif isinstance(content, str):
            path.symlink_to(content)
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            content(path)


def _listing(folder: Path) -> dict[str, Any]:
    """Contents of a folder by name: size and time of change."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        is_file = path.is_file() and not path.is_symlink()
        found[str(path.relative_to(folder))] = (status.st_size, status.st_mtime_ns) if is_file else None
    return found


def _memory(field: str) -> int:
    """Bytes of address space of this process, now or at most."""
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.partition(f"{field}:")[2].split()[0])


def _attempt(case: Case, folder: Path, output: Path) -> None:
    """Run the command line in a forked process, and end with its status, or with 99 if it raised an
    exception."""
    status = 99
    try:
        for name, number in (("out", 1), ("err", 2)):
            os.dup2(os.open(output / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), number)
        os.chdir(folder)
        begin = _memory("VmSize")
        resource.setrlimit(resource.RLIMIT_AS, (begin + MEMORY,) * 2)
        used = sum(os.times()[:2])
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(used) + SECONDS,) * 2)
        signal.alarm(PATIENCE)
        blysk.sim.cli.progress.SECONDS = 3600
        status = blysk.sim.cli.main.main(case.arguments)
        sys.stdout.flush()
        (output / "memory").write_text(str(_memory("VmPeak") - begin))
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(status)


def attempt(case: Case, root: Path) -> dict[str, Any]:
    """Try a case: the status, the output, the resources, and the files that are left."""
    folder, output = root / "outside" / "folder", root / "output"
    for path in (folder.parent, output, Path(tempfile.gettempdir())):
        shutil.rmtree(path, ignore_errors=True)
        path.mkdir()
    folder.mkdir()
    _put(folder, case.files)
    places = (folder.parent, Path(tempfile.gettempdir()))
    before = [_listing(place) for place in places]
    start = perf_counter()
    process = os.fork()
    if not process:
        _attempt(case, folder, output)
    _, status = os.waitpid(process, 0)
    seconds = perf_counter() - start
    after = [_listing(place) for place in places]
    changed = [
        name.removeprefix("folder/")
        for old, new in zip(before, after, strict=True)
        for name in sorted(old.keys() | new.keys())
        if old.get(name, "") != new.get(name, "") and name != "folder"
    ]
    memory = output / "memory"
    return {
        "name": case.name,
        "must_fail": case.must_fail,
        "status": os.waitstatus_to_exitcode(status),
        "says": (output / "err").read_text(errors="surrogateescape"),
        "prints": len((output / "out").read_bytes()),
        "changed": changed,
        "seconds": seconds,
        "memory": int(memory.read_text()) if memory.exists() else None,
    }


def _simulate_by_model() -> None:
    """Draw by the bit-accurate model, because only the code before and behind the pipeline is tried."""

    class Stub:
        def __init__(self, design, *_):
            self.design = design

        def render(self, scene, progress=None, vcd=None):
            frame = model_frame(scene, self.design)
            seconds = {"raster": 1.0, "simulate": 1.0}
            return SimulatedFrame(**vars(frame) | {"seconds": seconds}, cycles=1, engine="model")

    blysk.sim.api.render.FrameSimulator = Stub


def _warm_up(root: Path, cases: list[Case]) -> None:
    """Import modules before the processes are forked, because each process would import them."""
    folder = root / "first"
    folder.mkdir()
    here = os.getcwd()
    os.chdir(folder)
    for case in cases:
        _put(folder, {name: content for name, content in case.files.items() if not Path(name).exists()})
        with contextlib.redirect_stdout(io.StringIO()):
            assert blysk.sim.cli.main.main(case.arguments) == 0
    os.chdir(here)
    gc.freeze()


def run(root: Path, seed: int, count: int, every: int) -> None:
    """Try the good files, malformed files and bad options, and print each outcome."""
    _simulate_by_model()
    # This is the hardest case: names still come out of it in some form.
    sys.stdout.reconfigure(encoding="ascii")
    for path in (root / "temporary", root / "cache"):
        path.mkdir(mode=0o700)
    os.environ["TMPDIR"] = str(root / "temporary")
    os.environ["BLYSK_CACHE"] = str(root / "cache")
    tempfile.tempdir = None
    # The commands' modules are imported once, here.
    options = list(option_cases())[::every]
    good = [
        Case(f"good {kind}", ["render", next(iter(files)), *RENDER], files)
        for kind, files in good_files().items()
    ]
    _warm_up(root, good)
    files = [file_case(seed, index) for index in range(count)]
    for case in [*good, *files, *options]:
        print(json.dumps(attempt(case, root)), flush=True)


if __name__ == "__main__":
    run(Path(sys.argv[1]), *map(int, sys.argv[2:]))
