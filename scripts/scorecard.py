"""Shows which controller survives which imperfection: `oilcrane scorecard`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "scorecard")

if __name__ == "__main__":
    sys.exit(main())
