"""``python -m vkbloom._cli``: the command line for the tests."""

from vkbloom._cli import main

main()
