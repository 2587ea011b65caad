"""Compares reinforcement learning with the MPCs: `oilcrane compare-learners`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "compare-learners")

if __name__ == "__main__":
    sys.exit(main())
