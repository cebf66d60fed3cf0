"""`python -m seixo` is the command `seixo`."""

import sys

from ._cli import main

sys.exit(main())
