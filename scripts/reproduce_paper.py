"""Puts the paper to the test: `oilcrane reproduce`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "reproduce")

if __name__ == "__main__":
    sys.exit(main())
