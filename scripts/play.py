"""Opens the cockpit, the crane in a browser: `oilcrane play`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "play")

if __name__ == "__main__":
    sys.exit(main())
