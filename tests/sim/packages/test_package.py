"""What holds for every kind of package: refusals in a line, folders of their own, a help that names them."""

import dataclasses
import re
from pathlib import Path

import pytest

from blysk.golden.build import PORTS, TOPS
from blysk.golden.presets import preset
from blysk.sim.cli.main import main
from blysk.sim.errors import InputError
from blysk.sim.output import write_folder
from blysk.sim.packages.registry import PACKAGES

GUIDE = Path(__file__).parents[3] / "docs" / "guide" / "embedding.md"


@pytest.mark.parametrize("kind", PACKAGES)
def test_each_core_is_packaged_or_refused(kind, uninstalled):
    """A refusal names the package and a bus or a core that has this package."""
    package = dataclasses.replace(PACKAGES[kind], modules=())
    for top in TOPS:
        for bus in PORTS:
            design = preset("linear", "cosquad").built(top=top, bus=bus)
            if bus in package.buses and top in package.tops:
                package.check(design)
                continue
            with pytest.raises(InputError) as refused:
                package.check(design)
            assert refused.value.thing == f"--package {kind}"
            wanted = package.buses if bus not in package.buses else package.tops
            assert all(word in refused.value.remedy for word in wanted)
    if module := next(iter(PACKAGES[kind].modules), None):
        uninstalled(module)
        with pytest.raises(InputError, match=rf"{module} is not installed; .*\[packages\]"):
            PACKAGES[kind].check(preset().built(bus="axi"))


@pytest.mark.parametrize("kind", PACKAGES)
def test_the_help_and_the_guide_have_it(kind, capsys):
    assert main(["verilog", "--help"]) == 0
    assert f"{kind}:" in capsys.readouterr().out
    assert f" --package {kind} " in GUIDE.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["debian", "a"], "--package debian: unknown package; use one of " + ", ".join(PACKAGES)),
        (["vivado", "a"], "--package vivado: it has no form for --bus native; give --bus axi"),
        (
            ["litex", "a", "--bus", "wishbone", "--stream", "32"],
            "--package litex: it changes the widths of .*",
        ),
        (["fusesoc", "full"], "full: holds mine already; give a new or empty folder"),
        (["fusesoc", "full/mine"], "full/mine: it is a file; give the name of a folder"),
        (
            ["fusesoc", "not/there"],
            "not/there: cannot be written, there is no folder not; make the folder first",
        ),
        (["fusesoc"], ".*"),
    ],
)
def test_refused(options, line, tmp_path, monkeypatch, capsys):
    """The command writes nothing."""
    monkeypatch.chdir(tmp_path)
    Path("full").mkdir()
    Path("full/mine").write_text("mine\n")
    before = sorted(Path().rglob("*"))
    assert main(["verilog", "--package", *options]) == 2
    assert re.fullmatch(f"blysk: {line}\n", capsys.readouterr().err)
    assert sorted(Path().rglob("*")) == before


def test_a_folder_is_whole_or_not_there(tmp_path):
    """An error at the last file leaves no file and no folder that was made for it."""
    good = {"a/b/one": "1", "two": "2"}
    with pytest.raises(InputError):
        write_folder(tmp_path / "new", good | {"two/three": "3"})
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "empty").mkdir()
    with pytest.raises(UnicodeEncodeError):
        write_folder(tmp_path / "empty", good | {"three": "\ud800"})
    assert list((tmp_path / "empty").iterdir()) == []
    write_folder(tmp_path / "empty", good)
    found = {
        p.relative_to(tmp_path / "empty").as_posix(): p.read_text()
        for p in tmp_path.rglob("*")
        if p.is_file()
    }
    assert found == good
