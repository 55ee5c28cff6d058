"""Fits of measured materials: the formula written out, and the error of the lobe's table."""

import math

import numpy as np
import pytest

from blysk.golden.number.fixed import Fixed
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.measured import MEASURED


def written_out(fit, channel, normal, light, viewer):
    """The light of a fit at a point, by angles and sines."""
    half = light + viewer
    half = half / math.sqrt(half @ half)
    cosine = float(light @ half)
    inner = math.asin(math.sqrt(1 - cosine**2) / fit.index)
    outer = math.acos(cosine)
    across = (math.sin(outer - inner) / math.sin(outer + inner)) ** 2
    along = (math.tan(outer - inner) / math.tan(outer + inner)) ** 2
    lit, seen, facing = (float(normal @ of) for of in (light, viewer, half))
    masking = min(1, 2 * facing * seen / cosine, 2 * facing * lit / cosine)
    distribution = fit.peak[channel] / (1 + fit.b * (1 - facing)) ** fit.c
    brdf = (fit.diffuse[channel] + (across + along) / 2 * distribution * masking / (lit * seen)) / math.pi
    return fit.exposure * math.pi * brdf * lit


@pytest.mark.parametrize("name", MEASURED)
def test_the_whole_fit(name):
    fit, rng = MEASURED[name], np.random.default_rng(3)
    normal, light, viewer = normalise(rng.normal((0, 0, 2), 0.6, (3, 40, 3)))
    front = ((normal * light).sum(axis=1) > 0) & ((normal * viewer).sum(axis=1) > 0)
    assert front.sum() > 30
    found = fit.light(normal, light, viewer)
    assert not found[~front].any()
    for index in np.flatnonzero(front):
        for channel in range(3):
            expected = written_out(fit, channel, normal[index], light[index], viewer[index])
            assert found[index, channel] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", MEASURED)
def test_light_and_viewer_along_the_normal(name):
    """There the whole fit is k_d + k_s, and the largest channel is 1."""
    fit, up = MEASURED[name], np.array([[0.0, 0, 1]])
    diffuse, specular = fit.coefficients
    assert fit.light(up, up, up)[0] == pytest.approx(diffuse + specular)
    assert (diffuse + specular).max() == pytest.approx(1)
    assert fit.lobe(name).reflect([1.0, 0.0, -0.5]).tolist() == [1, 0, 0]


@pytest.mark.parametrize("name", MEASURED)
def test_table(name):
    """Terms of the bit-accurate unit are near the fit at arguments of every size: 0.1 LSB."""
    fit, rng = MEASURED[name], np.random.default_rng(4)
    lobe = (
        preset("chord-local", fit.lobe(name)).for_materials([Material((0,) * 3, (0,) * 3, (1,) * 3, 1)]).lobe
    )
    assert lobe.scale == 0
    codes = np.unique(np.exp2(rng.uniform(0, 25, 20_000)).astype(np.int64))
    found = lobe.compute(Fixed(lobe.operand_format, codes), np.zeros(codes.shape, bool), lobe.table())
    exact = np.where(codes < 1 << 25, (1 + fit.b * np.ldexp(codes, -25)) ** -fit.c, 0)
    error = np.abs(found.values - exact).max()
    assert error <= lobe.line_error(None) + lobe.ERROR
    assert 0.005 < 255 * error < 0.1


@pytest.mark.parametrize("name", MEASURED)
def test_line_error_of_the_default_method(name):
    lobe = preset("quotient", MEASURED[name].lobe(name)).lobe
    assert 0.005 < 255 * lobe.line_error(None) < 0.15
