"""The output transfer of pictures: their codes, errors and texts, from Python, files and Verilog."""

import numpy as np
import pytest

import blysk
from blysk.golden.reference.transfer import encode
from blysk.sim.errors import InputError

OPTIONS = {"size": (24, 18), "triangles": 100, "engine": "pysim"}


@pytest.fixture(scope="module")
def frames():
    """The same scene with both transfers."""
    return {of: blysk.render("teapot", transfer=of, **OPTIONS) for of in ("linear", "srgb")}


def test_pictures_of_one_scene(frames):
    """A code of sRGB stands for the light of the linear code, up to its rounding."""
    linear, srgb = (frames[of].image.astype(int) for of in ("linear", "srgb"))
    surface = (linear != linear[0, 0]).any(axis=-1)
    low, high = (255 * encode((linear + half) / 255) for half in (-0.51, 0.51))
    assert np.all((srgb >= low - 0.51) & (srgb <= high + 0.51))
    assert np.count_nonzero(surface) > 50
    assert srgb[surface].mean() > 1.3 * linear[surface].mean()


def test_errors_are_in_the_space_of_the_picture(frames):
    for transfer, space in (("linear", "linear light"), ("srgb", "sRGB")):
        frame = frames[transfer]
        assert frame.figures["transfer"] == frame.comparison.transfer == transfer
        assert frame.error.steady_lsb <= frame.comparison.bound_lsb < 1
        assert frame.error_map.max() < 1
        assert f"LSB of 8-bit {space}" in str(frame)
        assert f"LSB of {space}" in frame._repr_html_()


@pytest.mark.long
@pytest.mark.ci
def test_verilog_says_its_transfer():
    for transfer, space in (("linear", "linear light"), ("srgb", "sRGB")):
        text = blysk.verilog(blysk.design(transfer=transfer))
        assert f"transfer {transfer}: pixels are codes of {space}" in text
        assert ("transfer_0_code" in text) == (transfer == "srgb")


def test_other_transfers_are_refused():
    with pytest.raises(InputError, match=r"^transfer 'gamma': unknown; use one of srgb, linear$"):
        blysk.design(transfer="gamma")
