"""Lets persons bring payloads to places with every controller: `oilcrane study`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "study")

if __name__ == "__main__":
    sys.exit(main())
