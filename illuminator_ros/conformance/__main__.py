"""``python3 -m illuminator_ros.conformance``."""

import sys

from . import main

if __name__ == '__main__':
    sys.exit(main())
