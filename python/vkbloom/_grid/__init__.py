"""Grids: render all combinations of the axes' values, in memory, on disk or on a cluster.

========================== ========================================================================
module                     job
========================== ========================================================================
axes, sources              the axes, and the scene or images
order, parts               the order of the points, and blocks of points
passes                     the number of passes of a step, and of a point rendered alone
layout                     the requested grid, and its layout: variables, shapes, dtypes
filling                    render blocks of points into arrays
memory                     the grid as one Dataset
grid                       `vkbloom.grid`: in memory, or as a Zarr store
store, chunks, keys        the store's metadata, its chunks, and its keys as bytes
identity                   what determines the contents of a stored grid
checking                   check a store for missing and damaged data
rendering                  render a grid into a store
running, cluster           render blocks in this process, or on the workers of a Dask cluster
progress                   the progress bar
========================== ========================================================================
"""
