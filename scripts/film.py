"""Films controllers at work: `oilcrane film`."""

import sys
from functools import partial

from baselines.commands.oilcrane import run_command

main = partial(run_command, "film")

if __name__ == "__main__":
    sys.exit(main())
