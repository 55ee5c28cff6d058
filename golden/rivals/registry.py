"""The methods of a comparison by name: ours, and the rivals in the order of their years."""

from blysk.golden.rivals.abbas import Abbas
from blysk.golden.rivals.bishop_weimer import BishopWeimer
from blysk.golden.rivals.designs import ChordLocal, KuijkBlake, QuotientMethod, Renormalise
from blysk.golden.rivals.duff import Duff
from blysk.golden.rivals.loisel import Loisel
from blysk.golden.rivals.rival import Rival

__all__ = ["COMPARED", "RIVALS"]

RIVALS: dict[str, Rival] = {
    "duff": Duff(),
    "bishop-weimer": BishopWeimer(),
    "bishop-weimer-six": BishopWeimer("six"),
    "kuijk-blake": KuijkBlake(),
    "loisel": Loisel(),
    "abbas": Abbas(),
}
"""Methods of other people, as bit-accurate models."""

COMPARED: dict[str, Rival] = {
    "quotient": QuotientMethod(),
    "quotient, phong": QuotientMethod(mirror=True),
    "chord-local": ChordLocal(),
    "renormalise, 3": Renormalise(3),
    "renormalise, 2": Renormalise(2),
    "renormalise, 1": Renormalise(1),
    **RIVALS,
}
"""All methods of the comparison. The number of ``renormalise`` is its setup interval."""
