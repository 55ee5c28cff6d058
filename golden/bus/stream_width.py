"""Beats of a narrow stream: the words of a payload, one after the other, the lowest bytes first."""

from collections.abc import Mapping

import numpy as np

__all__ = ["MISSING", "gathered", "split"]

MISSING = 0x80
"""Byte that stands for each byte that is missing where a frame ends within a payload.

No field fits with this byte in all its places, signed or not, unless the field uses every bit of its bytes.
"""


def split(payloads: Mapping[str, np.ndarray], size: int) -> dict[str, np.ndarray]:
    """Words of payloads, with their flags.

    Parameters
    ----------
    payloads : mapping of str to array
        ``data``, uint8 of shape (N, bytes), and flags of shape (N,). ``first`` stays with the first word of
        a payload, every other flag with its last word.
    size : int
        Bytes of a word, of which the bytes of a payload are a multiple.
    """
    data = payloads["data"]
    count = data.shape[1] // size
    place = np.tile(np.arange(count), len(data))
    found = {"data": data.reshape(-1, size)}
    for name, flag in payloads.items():
        if name != "data":
            found[name] = np.repeat(flag, count) * (place == (0 if name == "first" else count - 1))
    return found


def gathered(words: Mapping[str, np.ndarray], size: int) -> dict[str, np.ndarray]:
    """Payloads of words. If a frame ends within a payload, its missing bytes are `MISSING`.

    Parameters
    ----------
    words : mapping of str to array
        ``data``, uint8 of shape (N, bytes), and ``last`` of a frame, shape (N,).
    size : int
        Bytes of a payload.
    """
    count, payloads, last, begun = size // words["data"].shape[1], [], [], []
    for word, ends in zip(words["data"], words["last"], strict=True):
        begun.append(word)
        if len(begun) == count or ends:
            payload = np.full(size, MISSING, dtype=np.uint8)
            payload[: sum(map(len, begun))] = np.concatenate(begun)
            payloads.append(payload)
            last.append(int(ends))
            begun = []
    return {"data": np.array(payloads).reshape(-1, size), "last": np.array(last, dtype=np.int64)}
