"""Draw the Utah teapot by simulated hardware, and write this hardware as Verilog: python render.py FOLDER."""

import sys
from pathlib import Path

import blysk

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
frame = blysk.render("teapot", exponent=200, size=(320, 240))
frame.save(folder / "teapot.png")
print(f"{frame.cycles:,} cycles, largest error {frame.error.max_lsb:.2f} LSB, {frame.error.psnr_db:.1f} dB")
(folder / "core.v").write_text(blysk.verilog(frame.design, name="teapot_core"))
