"""A classic of PLaSM: a temple, of columns, beams and a roof. Only the first line is another one than with pyplasm."""

from bsp2.plasm import *

# A column: base, shaft, capital. TOP puts the second thing upon the first, in its middle.
shaft = JOIN([T(3)(0)(CIRCLE(0.5)([24, 1])), T(3)(5)(CIRCLE(0.4)([24, 1]))])
block = CUBOID([1.4, 1.4, 0.3])
column = TOP([TOP([block, shaft]), block])

# STRUCT keeps what it is given, and each transformation in it acts on all that follows.
row = STRUCT(NN(6)([column, T(1)(3)]))
rows = STRUCT([row, T(2)(7), row])
ground = T([1, 2])([-0.8, -0.8])(CUBOID([18, 10, 0.4]))

# A beam on each row, small ones across: QUOTE makes intervals, negative ones are gaps, PROD multiplies.
beams = PROD([PROD([QUOTE([16.4]), QUOTE([1.4, -5.6, 1.4])]), QUOTE([0.6])])
joists = PROD([PROD([QUOTE(NN(20)([0.4, -0.42])), QUOTE([8.4])]), QUOTE([0.4])])

# The roof is a triangle times a length, turned from the ground into its place.
gable = MKPOL([[[0, 0], [8.4, 0], [4.2, 2.2]], [[1, 2, 3]], [[1]]])
roof = R([3, 1])(PI / 2)(R([1, 2])(PI / 2)(PROD([gable, QUOTE([16.4])])))

temple = TOP([TOP([TOP([TOP([ground, rows]), beams]), joists]), COLOR(RED)(roof)])
print("box from", MIN([1, 2, 3])(temple), "to", MAX([1, 2, 3])(temple))
VIEW(temple)  # BSP2_VIEW=none|png|browser says how
