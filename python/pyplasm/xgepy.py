from bsp2.plasm import *
from bsp2.plasm import __all__
