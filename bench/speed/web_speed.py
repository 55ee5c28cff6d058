"""Frames a second of the live page in headless Chromium on one core.

Other work on the machine takes a share of the core: frames per second of processor time do not depend on it.
"""

import math
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import click

from blysk.bench.command import run
from blysk.sim.errors import InputError
from blysk.sim.installation import install_package

__all__ = ["OPTIONS", "find_chromium", "frame_rates", "main"]

OPTIONS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
)
"""Options of the browser."""

_SCRIPT = """async ({design, mesh, frames}) => {
    Object.assign(blysk.state, blysk.site.start, {mesh, view: 0, method: design.method, model: design.model});
    const wait = (count) => new Promise((done) => {
        const check = () => blysk.frames >= count ? done(performance.now()) : setTimeout(check, 1);
        check();
    });
    blysk.setOrbit(true);
    const rates = [];
    let start = await wait(blysk.frames + 15);
    for (let run = 0; run < 3; run++) {
        const end = await wait(blysk.frames + frames);
        rates.push(1000 * frames / (end - start));
        start = end;
    }
    blysk.setOrbit(false);
    const {figures} = blysk.latest;
    const {pixels, cycles, seconds} = figures;
    return {rate: Math.max(...rates), pixels, cycles, seconds, count: 16 + 3 * frames};
}"""


def find_chromium() -> str | None:
    """Path of an installed Chromium, or ``None``."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def _browser_seconds() -> float:
    """Processor seconds of the browsers that this process started; NaN if the system does not give them."""
    parents, seconds = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = path.read_text().rpartition(")")
        except OSError:
            continue
        fields, number = rest.split(), int(path.parent.name)
        parents[number] = int(fields[1])
        if "(chrom" in name:
            seconds[number] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def is_ours(number: int) -> bool:
        while number in parents and number != os.getpid():
            number = parents[number]
        return number == os.getpid()

    return sum(time for number, time in seconds.items() if is_ours(number)) if seconds else math.nan


def frame_rates(site: Path, designs: Sequence[str] = (), frames: int = 40) -> dict[str, dict[str, float]]:
    """Frames a second, the best of three runs, of the page's animation of the light, frame by frame.

    Browser and worker share one core with this process, if the system can bind them to a core.

    Parameters
    ----------
    site : Path
        A site by ``blysk web``.
    designs : sequence of str
        Names of its modules; all by default.
    frames : int
        Number of frames of a run.

    Returns
    -------
    dict
        For each module and mesh: ``rate``, frames per second; ``processor_rate``, frames per second of the
        browser's processor time; ``pixels``, ``cycles`` and ``seconds`` of the last frame's simulation.

    Raises
    ------
    InputError
        If there is no site, no such module in it, no Chromium or no playwright.
    """
    page_file = Path(site).absolute() / "index.html"
    if not page_file.is_file():
        raise InputError(str(site), "is not a site", "make one with `blysk web -o FOLDER`")
    modules = sorted(path.stem for path in Path(site, "modules").glob("*.js"))
    unknown = [name for name in designs if name not in modules]
    if unknown:
        raise InputError(unknown[0], f"is not a module of {site}", f"choose from {', '.join(modules)}")
    chromium = find_chromium()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise InputError("browser", "playwright is not installed", install_package("playwright")) from None
    if chromium is None:
        raise InputError("browser", "there is no Chromium", "install one")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    found = {}
    with sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=chromium, args=list(OPTIONS))
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(120_000)
        page.goto(page_file.as_uri())
        page.wait_for_selector("body[data-frame]")
        known = page.evaluate("() => blysk.site.designs")
        meshes = page.evaluate("() => Object.keys(blysk.site.meshes)")
        for name in designs or known:
            for mesh in meshes if name == "quotient-blinn" else meshes[:1]:
                settings = {"design": known[name], "mesh": mesh, "frames": frames}
                before = _browser_seconds()
                row = page.evaluate(_SCRIPT, settings)
                row["processor_rate"] = row["count"] / (_browser_seconds() - before)
                found[f"{name} {mesh}"] = row
        browser.close()
    return found


@click.command()
@click.argument("site", type=click.Path(path_type=Path), default="site")
@click.argument("designs", nargs=-1, metavar="[MODULE ...]")
def _command(site, designs) -> int:
    """Measure the frames a second of a SITE by `blysk web`, for all its modules or the named ones."""
    found = frame_rates(site, designs)
    head = f"{'module, mesh':<32}{'frames/s':>9}{'frames/CPU s':>14}{'pixels':>9}{'cycles':>9}"
    click.echo(f"{head}{'Mpixel/s simulated':>20}")
    for name, row in found.items():
        speed = row["pixels"] / row["seconds"] / 1e6
        rates = f"{row['rate']:>9.1f}{row['processor_rate']:>14.1f}"
        click.echo(f"{name:<32}{rates}{row['pixels']:>9}{row['cycles']:>9}{speed:>20.2f}")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the rates of a site's modules.

    Returns
    -------
    int
        0; 2 for bad input, printed in one line.
    """
    return run(_command, "blysk.bench.speed.web_speed", arguments)


if __name__ == "__main__":
    sys.exit(main())
