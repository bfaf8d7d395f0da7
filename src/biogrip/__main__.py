"""Makes ``python -m biogrip`` the ``biogrip`` command."""

import sys

from biogrip.cli import main

sys.exit(main())
