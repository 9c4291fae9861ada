"""Grids of settings: every combination of some values, in memory, on disk, or over many machines.

========================== ========================================================================
module                     job
========================== ========================================================================
axes, sources              what varies, and what it is rendered from
order                      the order of visiting, and blocks of points
passes                     passes counted: the cost of a step, the cost of a point alone
plan                       the grid as asked for, and what a renderer says of it
filling, reductions        blocks of points rendered into arrays, and figures of frames
memory                     the grid as one Dataset
zarr_grid                  the grid as a Zarr store
store, keys, identity      what is in the store, its bytes, and whether it is the same grid again
image_files                the grid as image files
checking                   a store looked through
rendering                  a whole grid into whatever keeps it
running, cluster           blocks rendered in this process, or by the workers of a Dask cluster
sheet, curves, views       contact sheets and curves of a Dataset
progress                   the progress bar
========================== ========================================================================
"""
