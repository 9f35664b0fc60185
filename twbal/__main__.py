"""`python -m twbal` is `twbal`."""

import sys

from twbal.cli import main

if __name__ == "__main__":
    sys.exit(main())
