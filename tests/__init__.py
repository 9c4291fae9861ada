"""Tests of vkbloom."""

import os

# NumPy multiplies matrices in one thread in each test process. The matrices of the reference are
# small, and the threads of several processes would wait for each other in busy loops, which took
# more than half of the processor time of a comparison. Set before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
