# The names of `vkbloom._psf`; lazy_loader reads them, and imports what is asked for.
from .apertures import aperture as aperture
from .apertures import iris as iris
from .base import PSF as PSF
from .eye import cie_general as cie_general
from .eye import cie_total as cie_total
from .eye import spencer as spencer
from .lens import airy as airy
from .lens import gaussian as gaussian
from .lens import harvey_shack as harvey_shack
from .renderers import fog_glow as fog_glow
from .renderers import unreal as unreal
from .sampled import samples as samples
from .stars import star as star
from .varying import Gathered as Gathered
from .varying import Varying as Varying
