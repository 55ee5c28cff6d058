"""Text is the same however its file was saved."""

import codecs

import pytest

from blysk.golden.reference.lobes import TabulatedModel
from blysk.golden.text import is_wide, plain_text

TEXT = "ä b\n\nc\n"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"]
)
def test_marks_and_ends_of_lines(end, encoding):
    mark = "" if encoding.startswith("utf-8") else "\ufeff"
    data = (mark + TEXT.replace("\n", end)).encode(encoding)
    assert plain_text(data) == TEXT
    assert is_wide(data) == bool(mark)


def test_marks_inside_and_what_old_programs_put_at_the_end():
    assert plain_text(codecs.BOM_UTF8 + b"a\r\r\n" + codecs.BOM_UTF8 + b"b\0\x1a\0") == "a\n\nb"
    assert plain_text(b"f\xfcr", "replace") == "f\ufffdr"
    with pytest.raises(UnicodeDecodeError):
        plain_text(b"f\xfcr")


@pytest.mark.parametrize(
    "data",
    [
        b"\xef\xbb\xbf\r\n 0, 0\r\n1, 1\r\n",
        b"0,0\r1,1\r",
        b"cosine,value\r\r\n\n# C:\\curves\\\n0,0\n1,1",
        "0,0\n1,1\n".encode("utf-16"),
    ],
    ids=range(4),
)
def test_curves(tmp_path, data):
    (tmp_path / "a.csv").write_bytes(data)
    assert TabulatedModel.of_csv(tmp_path / "a.csv").reflect([0.25, 1.0]).tolist() == [0.25, 1]
