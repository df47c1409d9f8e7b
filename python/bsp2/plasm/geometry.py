"""Complexes, parted by what lives there: primitives, maps, assemblies, boxes, Booleans, shapes, and what is made of
these."""

from .primitives import *  # noqa: F401,F403
from .maps import *  # noqa: F401,F403
from .assemblies import *  # noqa: F401,F403
from .boxes import *  # noqa: F401,F403
from .booleans import *  # noqa: F401,F403
from .shapes import *  # noqa: F401,F403
from .constructs import *  # noqa: F401,F403
from .primitives import Q, _box, _there  # noqa: F401
from .shapes import _patches  # noqa: F401
