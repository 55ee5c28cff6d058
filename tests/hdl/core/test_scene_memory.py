# amaranth: UnusedElaboratable=no
"""Memories of a scene: with other words in them, the netlists of two scenes are equal."""

import numpy as np
from amaranth.back import rtlil

from blysk.golden.video.draw_commands import COMMAND_BITS, KINDS, DrawCommands
from blysk.hdl.core.scene_memory import contents_from
from blysk.hdl.video.draw_commands import DrawCommandsUnit


def test_netlists_of_two_scenes_differ_in_words_of_memories_alone():
    """Lists of two and of four commands have the same room. With their own words the netlists differ."""
    draw = [KINDS.index("draw"), 0, 0, 1]
    lists = [DrawCommands(np.array([draw] * count + [[0] * 4]), (0,)).padded(8) for count in (1, 3)]
    given = []

    def ones(name, width, words):
        given.append((name, width, words))
        return [1] * len(words)

    own = {rtlil.convert(DrawCommandsUnit(each)) for each in lists}
    with contents_from(ones):
        replaced = {rtlil.convert(DrawCommandsUnit(each)) for each in lists}
    assert (len(own), len(replaced)) == (2, 1)
    assert given == [("commands", COMMAND_BITS, each.codes) for each in lists]
    assert {rtlil.convert(DrawCommandsUnit(each)) for each in lists} == own
