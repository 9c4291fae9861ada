"""``vkbloom check``: the command, what it measures, and what it prints."""
