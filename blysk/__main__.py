"""``blysk`` and ``python -m blysk``: the command line."""

import sys

__all__ = ["main"]


def main() -> int:
    """Run `blysk.sim.cli.main.main`; an interrupt while it is imported ends as a later one does."""
    try:
        from blysk.sim.cli.main import main as run

        return run()
    except KeyboardInterrupt:
        print("blysk: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
