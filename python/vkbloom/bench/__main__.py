"""``python -m vkbloom.bench``, the same as ``vkbloom bench``."""

import sys

from vkbloom.cli import main

sys.argv[:1] = ["vkbloom", "bench"]
main()
