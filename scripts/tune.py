"""Tunes every controller with the same budget: `oilcrane tune`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "tune")

if __name__ == "__main__":
    sys.exit(main())
