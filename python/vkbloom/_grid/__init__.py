"""Grids: all combinations of the axes' values, in memory, in a Zarr store or on a cluster."""
