"""Computes how small the IAE of any policy can be: `oilcrane limit`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "limit")

if __name__ == "__main__":
    sys.exit(main())
