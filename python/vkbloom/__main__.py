"""``python -m vkbloom``: the command line."""

from __future__ import annotations

from vkbloom._cli import main

if __name__ == "__main__":
    main()
