"""The documents as a site: the Python interface, links, versions, the page of the boards."""

import hashlib
import html
import importlib.util
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import blysk
from blysk.bench.tools.boards import BOARDS

PROJECT = Path(__file__).parents[3]
SCRIPTS = PROJECT / "docs" / "site"
FORM = PROJECT / ".github" / "ISSUE_TEMPLATE" / "board.yml"

slow = [pytest.mark.ci, pytest.mark.long]


def script(name):
    """A script of the folder, as a module."""
    spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def texts(documents):
    """The pages of the newest version."""
    return {path: path.read_text(encoding="utf-8") for path in (documents / "latest").rglob("*.html")}


def words(text):
    """Text of a part of a page, without tags."""
    return html.unescape(re.sub(r"<[^>]+>", "", text))


class TestDocuments:
    pytestmark = slow

    def test_versions(self, documents):
        version = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
        assert {path.name for path in documents.iterdir() if path.is_dir()} == {version, "latest"}
        files = [
            sorted(p.relative_to(documents / v) for p in (documents / v).rglob("*"))
            for v in (version, "latest")
        ]
        assert files[0] == files[1]
        for name in (version, "latest"):
            assert f'href="{name}/index.html"' in (documents / "index.html").read_text()
            assert f'"{name}"' in (documents / "versions.js").read_text()

    def test_every_public_name_has_its_signature(self, texts):
        """On a page of its own, with the name of every parameter."""
        api = {path: text for path, text in texts.items() if path.parent.name == "api"}
        found = {}
        for name in blysk.__all__:
            (page,) = (path for path, text in api.items() if f'id="blysk.{name}">' in text)
            found[name] = page
            head = words(re.search(rf'<dt[^>]* id="blysk\.{name}">.*?</dt>', api[page], re.DOTALL)[0])
            of = getattr(blysk, name)
            # Exceptions without an own ``__init__`` have no signature in Python.
            if callable(of) and getattr(of, "__init__", None) is not Exception.__init__:
                names = inspect.signature(of).parameters
                assert [p for p in names if not re.search(rf"\b{p}\b", head)] == [], name
                assert inspect.getdoc(of).split()[0] in words(api[page])
        assert len({str(page).lower() for page in found.values()}) == len(blysk.__all__)
        options = words(api[found["render"]])
        assert all(name in options for name in blysk.METHODS)
        assert all(name in words(api[found["MODELS"]]) for name in blysk.MODELS)

    def test_a_property_keeps_its_text(self, texts):
        """Words before a colon stay in place."""
        (page,) = (text for path, text in texts.items() if path.stem == "class-renderedframe")
        text = inspect.getdoc(blysk.RenderedFrame.engine).replace("`", "")
        assert ":" in text
        assert " ".join(text.split()) in " ".join(words(page).split())

    def test_every_link_leads_somewhere(self, texts):
        ids = {path: set(re.findall(r'\bid="([^"]+)"', text)) for path, text in texts.items()}
        assert len(ids) > 50
        count = 0
        for path, text in texts.items():
            for address in map(html.unescape, re.findall(r'\b(?:href|src)="([^"]*)"', text)):
                if re.match(r"[a-z]+:", address):
                    assert not re.search(rf'(src|rel="stylesheet" href)="{re.escape(address)}', text), address
                    continue
                file, _, anchor = address.partition("#")
                target = (path.parent / file.partition("?")[0]).resolve() if file else path
                assert target.is_file(), (path, address)
                if anchor and target.suffix == ".html":
                    assert anchor in ids[target], (path, address)
                count += 1
        assert count > 1000

    def test_documents_link_each_other(self, texts):
        """Guide, theory, sources, units and interface, in both directions where there are links."""
        at = {"/".join(path.parts[-2:]): text for path, text in texts.items()}
        assert "../theory/quotient.html#" in at["guide/accuracy.html"]
        assert "../guide/glossary.html" in at["theory/index.html"]
        assert "../source/examples.method.nearest.py.html" in at["guide/layout.html"]
        assert "../theory/" in at["blocks/dot_product.html"]
        assert "../source/hdl.normals.dot_product.py.html" in at["blocks/dot_product.html"]
        assert "../theory/models.html#" in at["api/class-material.html"]
        assert "../guide/board.html#buttons" in at["boards/index.html"]

    def test_no_page_names_this_machine(self, documents):
        names = [str(PROJECT), str(Path.home()), "/tmp/"]
        for path in documents.rglob("*"):
            if path.suffix in (".html", ".js", ".css", ".inv"):
                text = path.read_text(encoding="utf-8", errors="replace")
                assert not [name for name in names if name in text], path


@pytest.mark.long
def test_a_warning_is_an_error(tmp_path):
    """The documents that were there stay."""
    pytest.importorskip("myst_parser", reason="myst-parser is not installed")
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "README.md").write_text("# Units\n\n[no page](nothing.md)\n")
    (tmp_path / "docs" / "latest").mkdir(parents=True)
    (tmp_path / "docs" / "latest" / "index.html").write_text("before")
    command = [sys.executable, SCRIPTS / "make.py", tmp_path / "docs", "--pages", tmp_path / "pages"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "nothing.md" in done.stderr
    assert [path.read_text() for path in tmp_path.rglob("*.html")] == ["before"]


def test_versions_in_order(tmp_path):
    for name in ("0.2.0", "0.10.0", "latest", "0.9.1", "1.0.0"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index.html").touch()
    (tmp_path / "other").mkdir()
    assert script("make").versions(tmp_path) == ["latest", "1.0.0", "0.10.0", "0.9.1", "0.2.0"]


def test_form_for_boards():
    """It has the parts that hosts of forms ask for, and every board."""
    yaml = pytest.importorskip("yaml", reason="pyyaml is not installed")
    given = yaml.safe_load(FORM.read_text(encoding="utf-8"))
    assert given["name"]
    assert given["description"]
    ids = []
    for element in given["body"]:
        assert element["type"] in ("markdown", "input", "textarea", "dropdown", "checkboxes")
        if element["type"] == "markdown":
            assert element["attributes"]["value"]
            continue
        ids.append(element["id"])
        assert element["attributes"]["label"]
        options = element["attributes"].get("options", [])
        assert (element["type"] in ("dropdown", "checkboxes")) == bool(options)
        assert len({str(option) for option in options}) == len(options)
        if element["id"] == "board":
            assert options == list(BOARDS)
    assert len(set(ids)) == len(ids)
    # The page has the same questions.
    page = " ".join(script("boards").form().split())
    for element in given["body"][1:]:
        assert element["attributes"]["label"] in page
        options = element["attributes"].get("options", [])
        assert all((option if isinstance(option, str) else option["label"]) in page for option in options)


@pytest.mark.ci
@pytest.mark.long
def test_page_of_the_boards(board_page, tmp_path, capsys):
    page = (board_page / "README.md").read_text(encoding="utf-8")
    assert "blysk-0-ulx3s-25f.bit" in page
    assert hashlib.sha256(b"bits").hexdigest() in page
    assert "openFPGALoader -b ulx3s " in page
    assert "| revisions of the board | 2.x and 3.0 |" in page
    assert "(ulx3s-25f/frame-0001.png)" in page
    assert "65.0 MHz, needed 52.5" in page
    assert "[ ] The mesh turns without jumps." in page
    # A board without its files is named.
    assert script("boards").main([str(tmp_path), "icepi-zero"]) == 2
    assert "icepi-zero" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
