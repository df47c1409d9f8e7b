"""pyplasm's name for bsp2.plasm: programs that begin with `from pyplasm import *` run unchanged."""

from bsp2.plasm import *
from bsp2.plasm import __all__
