"""What OpenImageIO's readers leave out of image files or get wrong: a module for each format."""
