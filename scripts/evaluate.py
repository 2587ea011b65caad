"""Compares controllers on operators' manoeuvres: `oilcrane evaluate`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "evaluate")

if __name__ == "__main__":
    sys.exit(main())
