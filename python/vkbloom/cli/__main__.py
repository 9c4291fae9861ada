"""``python -m vkbloom.cli``: the command line if the installed script is not on the path."""

from vkbloom.cli import main

main()
