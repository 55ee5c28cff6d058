"""``python -m blysk``: the command line."""

import sys

from blysk.sim.cli.main import main

sys.exit(main())
