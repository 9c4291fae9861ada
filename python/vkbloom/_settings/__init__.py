"""Settings: their fields, ranges and registries."""
