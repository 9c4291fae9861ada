"""Point-spread functions that follow from their fields; `vkbloom.psf` has them and `measured`."""

from __future__ import annotations

import lazy_loader

# Modules are imported at the first use of a name. Imported here, they could meet a thread that
# imports one of them and waits for this module: Python then gives one of the threads half a module.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
