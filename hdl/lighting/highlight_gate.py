"""Highlight gate, which stops spans without a visible highlight ([T] figure 4.10)."""

from amaranth.hdl import Cat, Const, Mux, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.dataflow import Dataflow, FunctionalUnit, checked_interval
from blysk.hdl.core.dot import dot, shared_sums
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = ["HighlightGateUnit"]


class HighlightGateUnit(PipelinedUnit):
    """Decides whether a span may be lit.

    The result is 0 only if every pixel of the span has a specular term of 0. The bit-accurate model
    `HighlightGate` has the comparisons with their words (T, u, w, a, b, d), the formats and the proof.

    There are fifteen multiplications: three for each of ``N_l . N_r``, ``N_l . H`` and ``N_r . H``, and six
    products for the comparisons: ``T u``, ``a b``, ``u w``, ``max(a, b)^2``, ``max(a, b) u`` and ``d^2``.
    With an initiation interval I they share ``ceil(15/I)`` multipliers (`dataflow`). The decisions are the
    same for every I. Every further light has twelve multiplications more.

    =================== == == == == == == == == == == == == == == ==
    initiation interval 1  2  3  4  5  6  7  8  9  10 11 12 13 14 15
    =================== == == == == == == == == == == == == == == ==
    latency             19 23 23 24 20 21 23 28 30 31 27 24 25 25 47
    multipliers         15 8  5  4  3  3  3  2  2  2  2  2  2  2  1
    =================== == == == == == == == == == == == == == == ==

    The PROM, which all lights share, holds 1024 words of 17 bits.

    Parameters
    ----------
    model : HighlightGate
        Bit-accurate model: reflection model, method and width.
    lights : int
        Number of lights, at least 1.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to the number of multiplications. ``None``: 6.
    exponent : int or None
        Exponent, 1 to 1000, fixed at build time. There is then no PROM. ``None``: the exponent is a port.
    takes_threshold : bool
        Whether the threshold T is a port in place of the exponent, as for the tables of a `Lobe`. There is
        then no PROM.

    Raises
    ------
    ValueError
        If ``initiation_interval`` or the exponent is out of range, or ``takes_threshold`` comes with an
        exponent.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left": ..., "normal_right": ...})))`
        Unit normals of the span's ends, three components ``SQ(1, F)`` each.
    o : :py:`Out(stream.Signature(unsigned(lights)))`
        Whether the span may be lit, a bit for each light. Bit 0 is the first light.
    constants : :py:`In(StructLayout({"halfway": ArrayLayout(..., lights), "exponent": 10}))`
        Unit vectors H. Also the exponent (1 to 1000), or ``threshold`` (T in F bits), unless the exponent is
        fixed. All are constant while beats are inside.

    Source: docs/theory/units.md#highlight-gate; [T] 4.2 and figure 4.10.
    """

    def __init__(
        self,
        model: HighlightGate,
        lights: int = 1,
        *,
        initiation_interval: int | None = None,
        exponent: int | None = None,
        takes_threshold: bool = False,
    ):
        self.model = p = model
        if exponent is not None and not 1 <= exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {exponent}")
        if exponent is not None and takes_threshold:
            raise ValueError("a gate with an exponent of its own takes no threshold")
        self.lights, self.exponent, self.takes_threshold = lights, exponent, takes_threshold
        count = 3 + 12 * lights
        interval = checked_interval(initiation_interval, count, 6)
        self._graph = Dataflow(interval)
        self._lit = self._describe()
        normal = data.ArrayLayout(FixedShape(p.component_format), 3)
        constants = {"halfway": data.ArrayLayout(normal, lights)}
        if takes_threshold:
            constants["threshold"] = unsigned(p.fraction_bits)
        elif exponent is None:
            constants["exponent"] = unsigned(p.specular.EXPONENT_BITS)
        super().__init__(
            data.StructLayout({"normal_left": normal, "normal_right": normal}),
            unsigned(lights),
            latency=self._lit.stage,
            initiation_interval=interval,
            constants=data.StructLayout(constants),
        )

    def datapath(self, m, operands):
        """The PROM, addressed by the exponent, and the registers of the graph."""
        p = self.model
        if self.takes_threshold:
            self._threshold = self.register(m, self.constants.threshold, "threshold")
        elif self.exponent is not None:
            self._threshold = Const(p.thresholds.codes[self.exponent].item(), p.fraction_bits)
        else:
            m.submodules.thresholds = prom = Memory(
                shape=p.fraction_bits, depth=1 << p.specular.EXPONENT_BITS, init=p.thresholds.codes.tolist()
            )
            port = prom.read_port()
            m.d.comb += port.addr.eq(self.constants.exponent)
            self._threshold = self.register(m, port.data, "threshold")
        return self._graph.build(m, self, operands)(self._lit, self.latency)

    def _describe(self) -> Word:
        """Word of the decisions."""
        g, p = self._graph, self.model
        f, angle = p.fraction_bits, p.angle_format
        left, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right")
        )

        sums = shared_sums(g, p.component_format * p.component_format)
        one = FixedValue.constant(p.one_squared.format, p.one_squared.values.item())
        difference = g.register(
            "difference", lambda cosine: one - cosine, dot(g, "cosine", left, right, sums)
        )
        cut = g.register(
            "cut", lambda x: Value.cast(x.truncate(angle.fraction_bits).saturate(angle)), difference
        )
        out_of_range = g.register("out_of_range", lambda cut: cut > p.widest.codes.item(), cut)
        u = g.register("u", lambda cut: Mux((cut + 3)[f], angle.max_code, (cut + 3)[:f])[:f], cut)

        lit = [self._lit_by(index, left, right, u, out_of_range, sums) for index in range(self.lights)]
        return lit[0] if len(lit) == 1 else g.register("lit", lambda *bits: Cat(bits), *lit)

    def _lit_by(
        self, index: int, left: Word, right: Word, u: Word, out_of_range: Word, sums: FunctionalUnit
    ) -> Word:
        """Word of the decision for one light."""
        g, p = self._graph, self.model
        f = p.fraction_bits
        step = FixedValue.constant(p.level_format, p.level_format.step)
        levels = []
        for name, normal in (("a", left), ("b", right)):
            level = dot(
                g, f"dot_{name}_{index}", normal, lambda _: self.constants.halfway[index], sums, f"H_{index}"
            )
            level = g.register(f"level_{name}_{index}", lambda dot: dot.truncate(f) + step, level)
            level = g.register(
                f"{name}_{index}", lambda level: Value.cast(level.saturate(p.level_format)), level
            )
            levels.append(level)
        a, b = levels

        factor = UQ(0, f)

        def multiply(name, x, y, left=lambda x: x, since=0):
            return g.multiply(
                f"{name}_{index}",
                x,
                y,
                lambda x: FixedValue(factor, left(x)),
                lambda y: FixedValue(factor, y),
                since=since,
            )

        # w = 2 T - T u - 2 a b, with 2 F + 1 fraction bits.
        product = multiply("threshold_u", u, u, lambda _: self._threshold)
        partial = g.register(
            f"partial_{index}", lambda x: ((self._threshold << (f + 2)) - Value.cast(x)).as_signed(), product
        )
        total = g.register(
            f"total_{index}",
            lambda partial, x: (partial - (Value.cast(x) << 2))[: 2 * f + 3].as_signed(),
            partial,
            multiply("a_b", a, b, since=partial),
        )
        # If w is 0, ``u w`` is 0 and the square reaches it. So the sign of w is enough.
        exceeded = g.register(f"exceeded_{index}", lambda w: w[-1], total)
        slack = g.register(f"slack_{index}", lambda w: w[f + 2 :][:f], total)

        minus = g.register(f"a_minus_b_{index}", lambda a, b: a - b, a, b)
        large = g.register(f"large_{index}", lambda minus, a, b: Mux(minus[-1], b, a), minus, a, b)
        span = g.register(
            f"absolute_difference_{index}", lambda minus: Mux(minus[-1], -minus, minus)[:f], minus
        )
        product = multiply("u_slack", u, slack)
        square = multiply("square", span, span, since=product)
        bright = g.register(
            f"bright_{index}",
            lambda x: Value.cast(x) >= (self._threshold << f),
            multiply("large_square", large, large),
        )
        inside = g.register(
            f"inside_{index}",
            lambda x, span: Value.cast(x) > (span << (f + 1)),
            multiply("large_u", large, u),
            span,
        )
        reached = g.register(
            f"reached_{index}",
            lambda square, x: Value.cast(square) >= Value.cast(x),
            square,
            product,
        )
        return g.register(
            f"lit_{index}",
            lambda out_of_range, bright, inside, exceeded, reached: (
                out_of_range | bright | (inside & (exceeded | reached))
            ),
            *(out_of_range, bright, inside, exceeded, reached),
        )
