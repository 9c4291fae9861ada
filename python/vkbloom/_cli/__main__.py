"""``python -m vkbloom.cli``: the command line if the installed script is not on the path."""

from vkbloom._cli import main

main()
