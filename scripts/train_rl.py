"""Trains a reinforcement learner: `oilcrane train`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "train")

if __name__ == "__main__":
    sys.exit(main())
