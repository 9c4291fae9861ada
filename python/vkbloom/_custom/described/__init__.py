"""Descriptions: shaders as engines ship them, and a file bloom.toml that says what runs them."""
