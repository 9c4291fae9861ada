"""Image files are read and written here, and each file is written whole or not at all."""
