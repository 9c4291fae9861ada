"""Point-spread functions: how the light of a point is distributed over a picture.

There are functions of the eye (`spencer`, `cie_general`, `cie_total`), of lenses (`harvey_shack`,
`airy`, `aperture` with `iris`), of renderers (`fog_glow`, `unreal`) and of settings (`measured`).
`gaussian` and `samples` are general. All are subclasses of `PSF`. `vkbloom.Convolution` convolves
an image with any of them.
"""

from __future__ import annotations

import lazy_loader

# Modules are imported at the first use of a name. Imported here, they could meet a thread that
# imports one of them and waits for this module: Python then gives one of the threads half a module.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
