"""The site of ``blysk web``: its data, its files, its command, without a browser."""

import base64
import json
import re
import zlib
from importlib import resources

import numpy as np
import pytest
from amaranth.hdl import Fragment
from click.testing import CliRunner

from blysk.bench.cli.web import command
from blysk.bench.web import web, web_data, web_designs, web_folder, web_meshes, web_spans
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.hdl.albedo.attribute_spans import span_attributes_shape
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.probes import probes_of
from blysk.sim.engines.wasm import fields_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra
from blysk.sim.run_files import RunFiles

from ..reader import Reader

pytest.importorskip("ziglang", reason="ziglang is not installed")

DESIGNS = [("quotient", "blinn"), ("quadratic", "cosquad"), ("linear", "exp")]


def unpacked(data):
    """Codes by column, and which fragments show, found as the page finds them, from the data of the page."""
    raw = zlib.decompress(data)
    count, fragments, columns = np.frombuffer(raw[:12], "<u4").tolist()
    at, codes = 12, {}
    for column in json.loads(json.dumps(web_spans.COLUMNS))[:columns]:
        values = np.zeros(count, dtype=np.int64)
        for byte in range(column["bytes"]):
            values += np.frombuffer(raw, np.uint8, count, at).astype(np.int64) << 8 * byte
            at += count
        values -= column["bias"]
        if "from" in column:
            values += codes[column["from"]]
        elif column.get("running"):
            values = np.cumsum(values)
        codes[column["name"]] = values
    visible = np.unpackbits(np.frombuffer(raw, np.uint8, offset=at), count=fragments, bitorder="little")
    assert at + -(-fragments // 8) == len(raw)
    return codes, visible.astype(bool)


@pytest.mark.parametrize("mesh", web_meshes.MESHES)
def test_spans_as_they_are_sent(mesh):
    body = web_meshes.MESHES[mesh]
    scene = web_data.scene_of(web_data.START | {"mesh": mesh, "view": body.views - 1})
    design = web_data.design_of("quotient", "blinn", True) if body.albedo else preset("quadratic", "cosquad")
    frame = prepare(scene, design)
    ratio = frame.cut_raster.magnitude_right / frame.cut_raster.magnitude_left
    codes, visible = unpacked(web_spans.encode(frame.spans, frame.cut_raster.visible, ratio))
    np.testing.assert_allclose(2 ** (codes["ratio"] / 2**19), ratio, rtol=2**-19)
    for name in ("x", "y", "length"):
        np.testing.assert_array_equal(codes[name], getattr(frame.spans, name))
    for c in range(3):
        for place in ("left", "right"):
            normal = getattr(frame.spans, f"normal_{place}")
            np.testing.assert_array_equal(codes[f"normal_{place}.{c}"], normal[:, c])
    np.testing.assert_array_equal(visible, frame.cut_raster.visible)
    assert visible.sum() > 1000
    # The names are those of the fields of the hardware.
    layout = span_attributes_shape(design.albedo.spans) if body.albedo else None
    names = {f"attributes.{name}" for name in fields_of(layout)} if body.albedo else set()
    assert {name for name in codes if name.startswith("attributes")} == names
    for name in names:
        _, *path, last = name.split(".")
        found = frame.spans.attributes.beats
        for key in path:
            found = found[key]
        found = found[:, int(last)] if last.isdigit() else found[last]
        np.testing.assert_array_equal(codes[name], found, err_msg=name)


def test_extreme_codes_are_kept():
    most = (1 << 17) - 1
    ends = np.array([[most, -most, 0], [-most, most, -1], [0, 0, most]])
    place = np.array([0, 4095, 0])
    spans = Spans(place, place[::-1], np.array([4095, 0, 1]), ends, ends[::-1])
    codes, visible = unpacked(web_spans.encode(spans, np.array([True] * 4095 + [False])))
    np.testing.assert_array_equal(codes["x"], spans.x)
    np.testing.assert_array_equal(codes["length"], spans.length)
    for c in range(3):
        np.testing.assert_array_equal(codes[f"normal_right.{c}"], spans.normal_right[:, c])
    assert len(visible) == 4096
    assert not visible[-1]


def test_streams_of_a_view():
    methods = ["linear", "quadratic", "angular", "quotient"]
    found = web_data.streams_of("teapot", 0, methods)
    assert json.loads(json.dumps(found)) == found
    axes = np.array(found["axes"])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    # Equal spans are there once.
    assert len(set(found["data"])) == len(found["data"])
    counts = {
        method: [len(unpacked(base64.b64decode(found["data"][k]))[0]["x"]) for k in numbers]
        for method, numbers in found["streams"].items()
    }
    # No span of quotient is cut for an exponent. Its ends are those of the true line, with the longer end as
    # 1.
    first, second = found["streams"]["quotient"]
    assert first == second
    codes, _ = unpacked(base64.b64decode(found["data"][first]))
    lengths = [
        np.linalg.norm([codes[f"normal_{side}.{c}"] for c in range(3)], axis=0) for side in ("left", "right")
    ]
    np.testing.assert_allclose(np.maximum(*lengths), (1 << 22) - 1, atol=2)
    assert np.minimum(*lengths).min() < 0.999 * (1 << 22)
    for k, exponent in enumerate(web_data.BANDS):
        design = preset("quadratic", "cosquad", transfer="srgb")
        frame = prepare(web_data.scene_of(web_data.START | {"exponent": exponent}), design)
        _, spans = web_data.spans_of("teapot", 0, exponent, design)
        assert counts["quadratic"][k] == len(spans) == len(frame.spans)


def test_addresses_are_those_of_the_write_port():
    tables = json.loads(json.dumps(web_data.tables()))
    constants = FrameConstants.of(web_data.scene_of(web_data.START), 1)
    beats = []
    for fields, base in ((tables["frame"], 0), (tables["light"], tables["stride"])):
        for name, (first, count) in fields.items():
            codes = np.ravel(getattr(constants, name)).tolist()
            assert len(codes) == count
            beats += [(base + first + k, code & 0x3FFFF) for k, code in enumerate(codes)]
    writes = constants.writes()
    assert beats == list(zip(writes["address"].tolist(), writes["data"].tolist(), strict=True))


# Names of words that the page's script lists by hand.


@pytest.fixture(scope="module")
def probes():
    """Probes of all modules of the page."""
    return [
        probe
        for design in (*web_designs.DESIGNS, (*web_designs.COLORED, True))
        for probe in probes_of(ShadingPipelineUnit(web_data.design_of(*design)))
    ]


@pytest.fixture(scope="module")
def script():
    return (
        resources.files("blysk.bench.web").joinpath("templates", "web", "app.js").read_text(encoding="utf-8")
    )


def names_in(braces):
    """Names in an object that a script writes down, with those of objects spread into it."""
    values = re.compile(r"\([^()]*\)|\[[^\[\]]*\]")
    entries = re.split(r"[,{}]", values.sub("", braces))
    return [name for entry in entries if (name := entry.partition(":")[0].strip()) not in ("", "...")]


@pytest.mark.long
def test_exact_values_are_those_of_the_probes(script, probes):
    (braces,) = re.findall(r"found\.set\(n, \{(.*?)\n +\}\);", script, re.DOTALL)
    names = names_in(braces)
    assert len(names) == len(set(names))
    assert set(names) == {probe.exact for probe in probes if probe.exact}


@pytest.mark.long
def test_dark_words_are_probes(script, probes):
    (names,) = re.findall(r"const isDark = (\[.*?\])", script)
    dark = set(json.loads(names))
    assert dark <= {probe.name for probe in probes}
    # All words of the specular data path that are numbers. Under the gate they belong to another pixel.
    assert dark == {probe.name for probe in probes if probe.block == "specular" and probe.name != "specular"}


@pytest.mark.long
def test_every_block_has_a_stage(script, probes, monkeypatch):
    def uncompiled(component):
        Fragment.get(component, None)
        return b""

    monkeypatch.setattr(web_data, "build", uncompiled)
    stages = {stage["name"] for stage in web_data.module_of("quadratic", "cosquad")["stages"]}
    (braces,) = re.findall(r"const stageOf = (\{.*?\})", script)
    stage_of = dict(re.findall(r'(\w+): "(\w+)"', braces))
    assert list(stage_of) == names_in(braces)
    blocks = {probe.block for probe in probes}
    assert set(stage_of) <= blocks
    assert {stage_of.get(block, block) for block in blocks} == stages


# The site, made of stubs for modules.


@pytest.fixture(scope="module")
def work():
    return web.tasks(DESIGNS, {"teapot": 1, "square": 2, "textured": 1})


@pytest.fixture(scope="module")
def results(work):
    module = {"wasm": "eJw=", "bytes": 65_432, "ports": {}, "probes": [{"exact": "</script>"}], "stages": []}
    streams = {"quotient": [0, 0], "quadratic": [0, 1], "linear": [0, 0]}
    view = {"axes": np.eye(3).tolist(), "streams": streams, "data": ["a", "b"]}
    return [module if task.function is web_data.module_of else view for task in work]


@pytest.fixture
def site(tmp_path, work, results):
    folder = tmp_path / "site"
    web.write_site(folder, work, results)
    return folder


def test_meshes_with_an_albedo_need_its_module():
    views = {"teapot": 1, "colored": 1, "textured": 1}
    assert [task.settings.get("mesh") for task in web.tasks(DESIGNS[1:], views)] == [None, None, "teapot"]
    served = web.tasks(DESIGNS, views)[-2:]
    assert [task.settings["methods"] for task in served] == [["quotient"], ["quotient"]]
    assert [name for name, body in web_meshes.MESHES.items() if body.albedo] == ["colored", "textured"]


def test_files_of_the_site(site):
    mark = json.loads((site / "site.json").read_text())
    there = sorted(path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file())
    assert there == sorted([*mark["files"], "site.json"])
    some = {"index.html", "modules/quadratic-cosquad.js", "models/blinn.js", "spans/square-1-1.js"}
    assert some | {"modules/quotient-blinn-albedo.js", "textures/textured.js"} <= set(there)
    page = Reader((site / "index.html").read_text())
    assert len(page.ids) == len(set(page.ids))
    text = " ".join((site / "index.html").read_text().split())
    *lower, highest = web_data.BANDS
    assert f"cut for the exponent {', '.join(map(str, lower))} or {highest}, the smallest" in text
    data = json.loads(page.texts["site"])
    plain = ["quotient-blinn", "quadratic-cosquad", "linear-exp"]
    assert list(data["designs"]) == [*plain, "quotient-blinn-albedo"]
    assert [name for name, design in data["designs"].items() if design["albedo"]] == ["quotient-blinn-albedo"]
    assert "this page leaves out alpha, emission, metals, unlit surfaces and the filter nearest" in text
    assert data["start"] == web_data.START
    assert data["mirrored"] == ["phong"]
    assert [len(mesh["views"]) for mesh in data["meshes"].values()] == [1, 2, 1]
    assert [mesh["albedo"] for mesh in data["meshes"].values()] == [False, False, True]
    for mesh in data["meshes"].values():
        for view in mesh["views"]:
            for names in view["streams"].values():
                assert len(names) == len(web_data.BANDS)
                assert all((site / "spans" / f"{name}.js").is_file() for name in names)
    script = (site / "modules" / "quadratic-cosquad.js").read_text()
    assert script.startswith('blysk.given("quadratic-cosquad",{')
    assert "</script>" not in script


def test_nothing_is_remote(site):
    for path in site.rglob("*"):
        if path.suffix in (".html", ".css") or path.name == "blysk.js":
            assert "http://" not in path.read_text().replace("http://www.w3.org", "")
            assert "https://" not in path.read_text()


def test_an_earlier_site_is_replaced(site, work, results):
    page = (site / "index.html").read_text()
    web.write_site(site, work[1:2] + work[4:5], results[1:2] + results[4:5])
    text = (site / "index.html").read_text()
    assert text != page
    assert "this page leaves out vertex colours, textures, alpha, emission" in " ".join(text.split())
    assert not (site / "textures" / "textured.js").exists()
    assert not (site / "modules" / "linear-exp.js").exists()
    assert not (site / "spans" / "square-0-0.js").exists()
    mark = json.loads((site / "site.json").read_text())
    assert "modules/linear-exp.js" not in mark["files"]
    web_folder.check_folder(site)


def test_folder_of_something_else(tmp_path, site):
    web_folder.check_folder(tmp_path / "new")
    (tmp_path / "empty").mkdir()
    web_folder.check_folder(tmp_path / "empty")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="it is a file"):
        web_folder.check_folder(tmp_path / "file")
    (site / "spans" / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds spans/mine.txt, which is not part of a site"):
        web_folder.check_folder(site)
    with pytest.raises(InputError, match="there is no folder"):
        web_folder.check_folder(tmp_path / "no" / "site")


def test_names_of_an_earlier_site_that_lead_out_stay(site, work, results, tmp_path):
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    mark = json.loads((site / "site.json").read_text())
    mark["files"] += ["../mine.txt", str(mine)]
    (site / "site.json").write_text(json.dumps(mark))
    web.write_site(site, work, results)
    assert mine.read_text() == "mine"


def test_report_in_the_site(tmp_path, work, results):
    report = tmp_path / "report"
    report.mkdir()
    (report / "index.html").write_text("<p>report</p>")
    (report / "report.json").write_text(
        json.dumps({"program": "blysk", "files": ["index.html", "report.json", "a.csv"]})
    )
    with pytest.raises(InputError, match="is not a report; make one with `blysk bench FOLDER`"):
        web.write_site(tmp_path / "site", work, results, report)
    (report / "a.csv").write_text("1,2\n")
    web.write_site(tmp_path / "site", work, results, report)
    assert (tmp_path / "site" / "report" / "a.csv").read_text() == "1,2\n"
    assert 'href="report/index.html"' in (tmp_path / "site" / "index.html").read_text()
    # Without it the link and the files disappear.
    web.write_site(tmp_path / "site", work, results)
    assert not (tmp_path / "site" / "report" / "a.csv").exists()
    assert "report/index.html" not in (tmp_path / "site" / "index.html").read_text()


@pytest.fixture
def docs(tmp_path):
    """Documents as `make docs` lays them out, without units and boards."""
    for place in ("index.html", "live.js", "latest/index.html", "0.2.0/index.html", "0.2.0/_static/a.css"):
        (tmp_path / "docs" / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "docs" / place).write_text(place)
    for place in web.DOCUMENTS:
        if "/blocks/" not in place and "/boards/" not in place:
            (tmp_path / place).parent.mkdir(exist_ok=True)
            (tmp_path / place).write_text(place)
    return tmp_path / "docs"


def test_documents_in_the_site(tmp_path, work, results, docs):
    """The live page links the first pages of the documents that are there, and they link the live page."""
    site = tmp_path / "site"
    web.write_site(site, work, results, None, docs)
    links = set(Reader((site / "index.html").read_text()).addresses)
    assert {place for place in web.DOCUMENTS if (tmp_path / place).is_file()} == links & set(web.DOCUMENTS)
    assert len(links & set(web.DOCUMENTS)) == 3
    assert (site / "docs" / "0.2.0" / "_static" / "a.css").read_text() == "0.2.0/_static/a.css"
    assert 'new URL("../index.html", document.currentScript.src)' in (site / "docs" / "live.js").read_text()
    # Without them the links and the files disappear.
    web.write_site(site, work, results)
    assert not [path for path in (site / "docs").rglob("*") if path.is_file()]
    assert "docs/latest" not in (site / "index.html").read_text()


def test_every_link_of_the_live_page_leads_somewhere(tmp_path, work, results, docs):
    """Files and anchors. The page has the answers of a report."""
    report = tmp_path / "report"
    report.mkdir()
    conclusion = {"title": "What?", "sentence": "**This** much."}
    sections = {"points": {"conclusion": conclusion}, "units": {"conclusion": None}}
    figures = {"program": "blysk", "files": ["index.html", "report.json"], "sections": sections}
    (report / "report.json").write_text(json.dumps(figures))
    (report / "index.html").write_text("<p>report</p>")
    site = tmp_path / "site"
    web.write_site(site, work, results, report, docs)
    text = (site / "index.html").read_text()
    assert "<strong>This</strong> much." in text
    assert ' style="' not in text
    page = Reader(text)
    for address in page.addresses:
        file, _, anchor = address.partition("#")
        assert (site / file).is_file() if file else anchor in page.ids, address


def test_folder_of_documents(docs):
    assert web_folder.docs_files(docs)["0.2.0/_static/a.css"] == docs / "0.2.0" / "_static" / "a.css"
    (docs / "live.js").unlink()
    with pytest.raises(InputError, match="holds no documents; make them with `make docs`"):
        web_folder.docs_files(docs)


# The command.


def run(*arguments):
    """Run the command as the program does, which records what it reads and writes."""
    with RunFiles().active():
        return CliRunner().invoke(command, list(map(str, arguments)))


def test_command(tmp_path, monkeypatch, work, results, plain_section):
    asked = []

    def made(tasks, jobs, progress):
        asked.extend(tasks)
        for _ in tasks:
            progress()
        return [results[0] if task.function is web_data.module_of else results[-1] for task in tasks]

    # The report that is measured with it.
    monkeypatch.setattr(web, "chosen_tasks", lambda quick: [])
    monkeypatch.setattr(web, "measured", lambda chosen, jobs, count: [plain_section])
    monkeypatch.setattr(web, "measure_all", made)
    chosen = [word for design in DESIGNS for word in ("--design", "/".join(design))]
    found = run("-o", tmp_path / "site", *chosen)
    assert found.exit_code == 0, found.output
    report = json.loads((tmp_path / "site" / "report" / "report.json").read_text())
    assert report["quick"]
    assert list(report["sections"]) == ["plain"]
    assert found.output.split() == ["site", str(tmp_path / "site" / "index.html")]
    modules = [task.settings for task in asked if task.function is web_data.module_of]
    plain = [{"method": method, "model": model} for method, model in DESIGNS]
    assert modules == [*plain, plain[0] | {"albedo": True}]
    assert len(asked) - len(modules) == sum(body.views for body in web_meshes.MESHES.values())


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--design", "angular"], "--design angular: unknown model; use one of"),
        (
            ["--design", "chord-local/exp"],
            f"--design chord-local/exp: unknown method; use one of {next(iter(METHODS))}",
        ),
        (
            ["--design", "angular/phong"],
            f"--design angular/phong: unknown model; use one of {next(iter(MODELS))}",
        ),
        (
            ["--design", "quotient/cosquad"],
            "--design quotient/cosquad: unknown model; use one of blinn, ggx, phong",
        ),
        (["--report", "nothing"], "--report nothing: is not a report; make one with `blysk bench FOLDER`"),
        (["--docs", "nothing"], "--docs nothing: holds no documents; make them with `make docs`"),
        (["-o", "no/site"], "no/site: cannot be written, there is no folder no; make the folder first"),
    ],
)
def test_command_refuses(tmp_path, monkeypatch, arguments, line):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as error:
        CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert str(error.value).startswith(line)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["ziglang", "jinja2", "markdown_it", "flip_evaluator", "skimage"])
def test_command_without_the_extra(tmp_path, uninstalled, name):
    uninstalled(name)
    with pytest.raises(
        InputError, match=f"^web: {name} is not installed; {re.escape(install_extra('web'))}$"
    ):
        CliRunner().invoke(command, ["-o", str(tmp_path / "site")], catch_exceptions=False)
    assert not list(tmp_path.iterdir())


def test_command_interrupted(tmp_path, monkeypatch):
    def stop(tasks, jobs, progress):
        progress()
        raise KeyboardInterrupt

    monkeypatch.setattr(web, "measure_all", stop)
    found = run("-o", tmp_path / "site")
    assert found.exit_code == 130
    assert "stopped; 1 of" in found.output
    assert not (tmp_path / "site").exists()


@pytest.mark.long
def test_interrupt_leaves_nothing_behind(interrupted):
    """A worker is interrupted in the midst of a program of its own, with its own files."""
    status, text = interrupted(
        "import subprocess, sys, tempfile\n"
        "from blysk.bench.web import web\n"
        "from blysk.bench.store import Task\n"
        "def sleep(seconds):\n"
        "    with tempfile.TemporaryDirectory(prefix='blysk-'):\n"
        "        subprocess.run(['sleep', str(seconds)])\n"
        "if __name__ == '__main__':\n"
        "    web.tasks = lambda designs, views: [Task(sleep, {'seconds': 300})]\n"
        "    web.chosen_tasks = lambda quick: []\n"
        "    from blysk.bench.cli.web import command\n"
        "    sys.exit(command.main(['--jobs', '1'], standalone_mode=False))\n"
    )
    assert status == 130
    assert text == "blysk: stopped; 0 of 1 parts are kept, run again to continue\n"
