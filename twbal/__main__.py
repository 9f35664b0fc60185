"""`python -m twbal` is `twbal`."""

import sys

from twbal.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
