"""Tests of vkbloom."""

import os

# One thread for the products of matrices in the NumPy reference, in each of the tests' processes:
# they are small, and the threads of several processes would wait for each other in busy loops (more
# than half of the processor's time of a comparison with the reference). Before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
