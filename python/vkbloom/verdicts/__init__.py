"""What a bloom is worth: all measurements of one bloom, for ``vkbloom check``."""
