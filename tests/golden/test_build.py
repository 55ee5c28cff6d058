"""Build options: some combinations are refused, and pixels do not depend on the options."""

import pickle
from dataclasses import fields

import pytest

from blysk.golden.build import Build, BuildError
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.presets import preset

COARSE = CoarseDepth(64, 48)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"style": "fast"}, "style must be one of throughput, compact, not 'fast'"),
        ({"lanes": 3}, "lanes must be one of 1, 2, 4, not 3"),
        ({"pipes": 3}, "pipes must be one of 1, 2, 4, 8, not 3"),
        ({"top": "gpu"}, "top must be one of shader, geometry, render, not 'gpu'"),
        ({"setups": 0}, "setups must be one of 1, 2, 4, not 0"),
        ({"geometry_style": ""}, "geometry_style must be one of throughput, compact, not ''"),
        ({"bus": "apb"}, "bus must be one of native, axi, wishbone, not 'apb'"),
        ({"exponent": 0}, "exponent must be 1 to"),
    ],
)
def test_unknown_values(options, message):
    with pytest.raises(ValueError, match=message):
        Build(**options)


@pytest.mark.parametrize(
    ("option", "options"),
    [
        ("pipes", {"pipes": 2, "top": "geometry"}),
        ("pipes", {"pipes": 2, "top": "render"}),
        ("pipes", {"pipes": 4, "bus": "axi"}),
        ("lanes", {"lanes": 2, "pipes": 2}),
        ("lanes", {"lanes": 2, "bus": "axi"}),
        ("lanes", {"lanes": 2, "top": "geometry"}),
        ("lanes", {"lanes": 4, "top": "render"}),
        ("lanes", {"lanes": 2, "style": "compact"}),
        ("merged", {"merged": True}),
        ("setups", {"setups": 2}),
        ("geometry_style", {"geometry_style": "compact"}),
        ("coarse", {"coarse": COARSE}),
        ("coarse", {"coarse": COARSE, "top": "geometry"}),
    ],
)
def test_options_that_exclude_each_other(option, options):
    """Options that exclude each other are refused, and none is ignored.

    The error survives the transfer from another process.
    """
    with pytest.raises(BuildError) as error:
        preset().built(**options)
    again = pickle.loads(pickle.dumps(error.value))
    assert (again.option, str(again)) == (option, str(error.value))
    assert str(again).startswith(f"{option}: ")


def test_styles_of_geometry():
    assert not Build(top="render").compact_geometry
    assert Build("compact", top="render").compact_geometry
    small = Build(top="render", geometry_style="compact")
    assert (small.compact, small.compact_geometry) == (False, True)
    wide = Build("compact", top="render", geometry_style="throughput")
    assert (wide.compact, wide.compact_geometry) == (True, False)


def test_options_of_shading_alone():
    """The options that other parts of a core read keep their defaults, whatever other options are given."""
    build = Build("compact", 9, 20, top="render", setups=2, coarse=COARSE, bus="axi")
    assert build.shading == Build("compact", 9, 20)
    default = Build()
    of_shading = {"style", "setup_interval", "exponent"}
    for field in fields(Build):
        same = build.shading if field.name in of_shading else default
        assert getattr(build.shading, field.name) == getattr(same, field.name)
