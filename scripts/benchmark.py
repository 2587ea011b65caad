"""Measures the speed of environment and controllers: `oilcrane benchmark`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "benchmark")

if __name__ == "__main__":
    sys.exit(main())
