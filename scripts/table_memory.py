"""Measures tabulated controllers, error against memory: `oilcrane table-memory`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "table-memory")

if __name__ == "__main__":
    sys.exit(main())
