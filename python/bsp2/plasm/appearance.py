"""Colours, materials, textures, and VIEW."""

import builtins
import os

from ._complex import Hpc


class Color4f:
    """A colour: red, green, blue and opacity, from 0 to 1."""

    def __init__(self, *values):
        if len(values) == 1 and isinstance(values[0], Color4f):
            values = [values[0].r, values[0].g, values[0].b, values[0].a]
        elif len(values) == 1:
            values = list(values[0])
        values = [float(value) for value in values] or [0.0, 0.0, 0.0]
        self.r, self.g, self.b = values[:3]
        self.a = values[3] if len(values) > 3 else 1.0

    def __getitem__(self, index):
        return [self.r, self.g, self.b, self.a][index]

    def __eq__(self, other):
        return isinstance(other, Color4f) and [*self] == [*other]

    def __hash__(self):
        return hash((self.r, self.g, self.b, self.a))

    def __repr__(self):
        return f"Color4f({self.r}, {self.g}, {self.b}, {self.a})"


GRAY = Color4f(0.5, 0.5, 0.5, 1.0)
GREEN = Color4f(0.0, 1.0, 0.0, 1.0)
BLACK = Color4f(0.0, 0.0, 0.0, 1.0)
BLUE = Color4f(0.0, 0.0, 1.0, 1.0)
BROWN = Color4f(0.6, 0.2, 0.2, 1.0)
CYAN = Color4f(0.0, 1.0, 1.0, 1.0)
MAGENTA = Color4f(1.0, 0.0, 1.0, 1.0)
ORANGE = Color4f(1.0, 0.5, 1.0, 1.0)
PURPLE = Color4f(0.5, 0.0, 0.5, 1.0)
WHITE = Color4f(1.0, 1.0, 1.0, 1.0)
RED = Color4f(1.0, 0.0, 0.0, 1.0)
YELLOW = Color4f(1.0, 1.0, 0.0, 1.0)


def with_property(pol, name, value):
    return Hpc([pol], props={name: value})


def COLOR(color):
    """A colour, as Color4f or a list of 3 or 4 numbers. The innermost one counts."""
    if isinstance(color, (list, tuple)) and len(color) in (3, 4):
        color = Color4f(*color)
    if not isinstance(color, Color4f):
        raise TypeError(f"a colour is a Color4f, or 3 or 4 numbers, not {color!r}")
    text = f"{color.r} {color.g} {color.b} {color.a}"
    return lambda pol: with_property(pol, "RGBcolor", text)


def HEX(color, alpha=1):
    """A colour as "#rrggbb"."""
    digits = color.lstrip("#")
    part = len(digits) // 3
    values = [int(digits[i : i + part], 16) / 255.0 for i in builtins.range(0, 3 * part, part)]
    return COLOR(Color4f(*values, alpha))


def MATERIAL(values):
    """A material: 17 numbers (ambient, diffuse, specular, emission, shininess), or a colour of 3 or 4."""
    if isinstance(values, (list, tuple)) and len(values) in (3, 4):
        color, alpha = list(values[:3]), values[3] if len(values) == 4 else 1.0
        ambient, diffuse = [0.4 * value for value in color], [0.6 * value for value in color]
        values = ambient + [alpha] + diffuse + [alpha] + [0, 0, 0, alpha] + [0, 0, 0, alpha] + [100]
    if not (isinstance(values, (list, tuple)) and len(values) == 17):
        raise TypeError(f"a material is a list of 17 numbers, or a colour of 3 or 4, not {values!r}")
    text = " ".join(str(value) for value in values)
    return lambda pol: with_property(pol, "VRMLmaterial", text)


def TEXTURE(params):
    """Kept as a property: pictures of ours have no textures."""
    name = params if isinstance(params, str) else params[0]
    if not isinstance(name, str):
        raise TypeError(f"a texture is the path of a picture, not {name!r}")
    return lambda pol: with_property(pol, "texture", name)


def SETPROPERTY(pair):
    """A property of a complex: [name, value]."""
    return lambda pol: with_property(pol, pair[0], pair[1])


viewers = []
"""Functions of a complex that VIEW calls first; one that gives True is all that is done."""

_views = 0


def VIEW(pol, Background=True):
    """Shows a complex, as BSP2_VIEW says: none, png (a picture, the default without a display) or browser."""
    if not isinstance(pol, Hpc):
        raise TypeError(f"VIEW takes a complex, not {type(pol).__name__}")
    if any([viewer(pol) for viewer in list(viewers)]):
        return pol
    how = os.environ.get("BSP2_VIEW") or ("browser" if os.environ.get("DISPLAY") else "png")
    if how not in ("none", "png", "browser"):
        raise ValueError(f"BSP2_VIEW is none, png or browser, not {how}")
    if how != "none":
        from . import _view

        global _views
        _views += 1
        _view.show(pol, how, _views)
    return pol
