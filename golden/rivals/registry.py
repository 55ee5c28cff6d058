"""The rivals by name, in the order of their years."""

from blysk.golden.rivals.abbas import Abbas
from blysk.golden.rivals.bishop_weimer import BishopWeimer
from blysk.golden.rivals.duff import Duff
from blysk.golden.rivals.loisel import Loisel
from blysk.golden.rivals.rival import Rival

__all__ = ["RIVALS"]

RIVALS: dict[str, Rival] = {
    "duff": Duff(),
    "bishop-weimer": BishopWeimer(),
    "bishop-weimer-six": BishopWeimer("six"),
    "loisel": Loisel(),
    "abbas": Abbas(),
}
"""Bit-accurate models by name. Other rivals have hardware in this project, see docs/theory/rivals.md."""
