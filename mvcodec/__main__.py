"""`python -m mvcodec`: the same as the command `mvcodec`."""

import sys

from mvcodec.cli.main import main

sys.exit(main())
