"""A serial flash for simulations in Amaranth."""

from blysk.golden.bus.packets import END

OFFSET = 0x12F05


def flash_of(pins, contents):
    """A flash of mode 0 that knows the read command alone. Its contents begin at `OFFSET`."""

    async def flash(ctx):
        command, bits, sent, clock = 0, 0, "", 0
        while True:
            now, selected = ctx.get(pins.clock), ctx.get(pins.select)
            if not selected:
                command, bits, sent = 0, 0, ""
            elif now and not clock:
                command, bits = command << 1 | ctx.get(pins.to), bits + 1
            elif clock and not now and bits >= 32:
                assert command >> bits - 32 == 0x03 << 24 | OFFSET
                if not sent:
                    place = (bits - 32) // 8
                    sent = f"{contents[place] if place < len(contents) else END:08b}"
                ctx.set(pins.back, int(sent[0]))
                sent = sent[1:]
            clock = now
            await ctx.tick()

    return flash
