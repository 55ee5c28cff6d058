"""Light unit: diffuse and specular term of one light ([T] figure 4.10)."""

from amaranth.hdl import Module, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.diffuse import Diffuse
from golden.power import Power
from golden.specular import Specular

from .diffuse import DiffuseUnit
from .fixed import FixedShape
from .power import PowerUnit
from .specular import SpecularUnit

__all__ = ["LightUnit"]


class LightUnit(wiring.Component):
    """``max(N . L, 0)`` and the reflection model of ``N . H``, for one light.

    The diffuse and the specular unit run in lockstep: their latencies are equal, they are offered the same
    beats and taken from on the same clocks, so what holds of one handshake holds of the other. The specular
    unit is told when the light is behind the surface.

    The latency, the initiation interval and the multipliers are those of the specular unit.

    Parameters
    ----------
    parameters : Specular or Power
        Reflection model, and whether ``highlight`` is ``N . H`` or one minus it.
    diffuse : Diffuse
        Format of ``N . L``.
    initiation_interval : int
        Distance in clocks of two inputs, at least 1. That of `Power` is 42 from 42 on, else 1.
    exponent : int or None
        An exponent for good; see `SpecularUnit`. `Power` has none.
    shares_slope : bool
        Whether a `SlopeUnit` outside works out what follows from the exponent. `Power` needs nothing.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"cosine", "highlight"})))`
        ``N . L`` and the specular operand.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse", "specular"})))`
        Terms, ``UQ(0, 17)``.
    constants
        That of the specular unit: exponent, slope, or none.

    Source: [T] figure 4.10; [B] 4.
    """

    def __init__(
        self,
        parameters: Specular | Power | None = None,
        diffuse: Diffuse | None = None,
        initiation_interval: int = 1,
        *,
        exponent: int | None = None,
        shares_slope: bool = False,
    ):
        self.parameters = p = parameters or Specular()
        if isinstance(p, Power):
            self._specular = PowerUnit(p, "sequential" if initiation_interval >= 42 else "pipelined")
        else:
            self._specular = SpecularUnit(
                p, initiation_interval, exponent=exponent, shares_slope=shares_slope
            )
        self.latency = self._specular.latency
        self.initiation_interval = self._specular.initiation_interval
        self._diffuse = DiffuseUnit(self.latency, diffuse, self.initiation_interval)
        operands = {
            "cosine": FixedShape(self._diffuse.parameters.operand_format),
            "highlight": FixedShape(self.parameters.operand_format),
        }
        terms = dict.fromkeys(("diffuse", "specular"), FixedShape(Diffuse.RESULT_FORMAT))
        members = {
            "i": In(stream.Signature(data.StructLayout(operands))),
            "o": Out(stream.Signature(data.StructLayout(terms))),
        }
        if "constants" in self._specular.signature.members:
            members["constants"] = self._specular.signature.members["constants"]
        super().__init__(members)

    def elaborate(self, platform):
        """Two units side by side."""
        m = Module()
        m.submodules.diffuse = diffuse = self._diffuse
        m.submodules.specular = specular = self._specular
        cosine = Value.cast(self.i.payload.cosine)
        m.d.comb += [
            diffuse.i.payload.eq(self.i.payload.cosine),
            specular.i.payload.operand.eq(self.i.payload.highlight),
            specular.i.payload.dark.eq(cosine[-1] | ~cosine.any()),
            self.i.ready.eq(diffuse.i.ready),
            self.o.payload.diffuse.eq(diffuse.o.payload),
            self.o.payload.specular.eq(specular.o.payload),
            self.o.valid.eq(diffuse.o.valid),
        ]
        if "constants" in self.signature.members:
            m.d.comb += Value.cast(specular.constants).eq(Value.cast(self.constants))
        for unit in (diffuse, specular):
            m.d.comb += [unit.i.valid.eq(self.i.valid), unit.o.ready.eq(self.o.ready)]
        return m
