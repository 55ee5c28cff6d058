"""Messages are one line, whatever is put into them."""

import pickle

import pytest

from blysk.sim.errors import InputError, one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a b", "a b"),
        ("żółw 🫖", "żółw 🫖"),
        ("a\nb\r\tc", "a?b??c"),
        ("\x1b[31m\0", "?[31m?"),
        ("\udcff\u202e\u2028", "???"),
        ("12345678", "12345678"),
        ("123456789", "12345..."),
        ("", ""),
    ],
)
def test_one_line(text, line):
    assert one_line(text, 8) == line


def test_message():
    error = InputError("a\nb" + 1000 * "x", "c\x1b", "d\n")
    assert str(error) == f"a?b{394 * 'x'}...: c?; d?"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
