"""`python -m baselines.commands`: the program `oilcrane` where it is not on the path."""

import sys

from baselines.commands.oilcrane import main

sys.exit(main())
