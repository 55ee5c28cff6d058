"""Texts of files in any encoding and with any line ends, and texts of numbers."""

import codecs

__all__ = ["is_wide", "numbers_of_text", "plain_text"]

# UTF-32 comes first: its little-endian mark begins with the little-endian mark of UTF-16.
_MARKS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


def is_wide(data: bytes) -> bool:
    """Whether a byte order mark says that characters take two or four bytes."""
    return data.startswith(tuple(_MARKS))


def plain_text(data: bytes, errors: str = "strict") -> str:
    r"""The text of a file's bytes: UTF-8, or in the encoding of its byte order mark.

    Each line ends with ``\n``, also where the file has ``\r\n`` or a lone ``\r``. Marks are removed
    everywhere, because joined files have them inside. The bytes 0 and 26 at the end, from old programs, are
    removed too.

    Parameters
    ----------
    data : bytes
        Contents of the file.
    errors : {"strict", "replace"}
        What happens to bytes that are not text.

    Raises
    ------
    UnicodeDecodeError
        If bytes are not text, and ``errors`` is ``"strict"``.
    """
    encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "utf-8")
    text = data.decode(encoding, errors).replace("\ufeff", "").rstrip("\0\x1a")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def numbers_of_text(text: str) -> list[float]:
    """Read numbers with commas between them, by the rules of `float`.

    Raises
    ------
    ValueError
        If a part is not a number.
    """
    return [float(part) for part in text.split(",")]
