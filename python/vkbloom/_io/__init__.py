"""Read and write image files; a file is written completely or not at all."""
