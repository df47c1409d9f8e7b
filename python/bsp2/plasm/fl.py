"""The functions of FL, by which PLaSM's programs are put together: combinators, lists, numbers, vectors,
tests."""

import builtins
import itertools
import math
from functools import reduce

import numpy as np

from ._complex import Hpc

# Numbers.
PI = math.pi
SIN, COS, TAN = math.sin, math.cos, math.tan
ASIN, ACOS, ATAN = math.asin, math.acos, math.atan
SINH, COSH, TANH = math.sinh, math.cosh, math.tanh
SQRT, EXP, LN = math.sqrt, math.exp, math.log
CEIL, FLOOR, ABS = math.ceil, math.floor, abs
CHAR, ORD = chr, ord
TRUE, FALSE = True, False


def ATAN2(pair):
    """The angle of the vector [x, y]."""
    return math.atan2(pair[1], pair[0])


def MOD(pair):
    """The remainder of a division, as a float."""
    return float(pair[0] % pair[1])


def SIGN(number):
    return 1 if number >= 0 else -1


def FACT(n):
    return math.factorial(int(n)) if n > 0 else 1


def CHOOSE(pair):
    """The binomial coefficient of [n, k], as a float."""
    return float(math.comb(*(int(number) for number in pair)))


def PASCALTRIANGLE(n):
    return [[math.comb(row, k) for k in builtins.range(row + 1)] for row in builtins.range(n + 1)]


# Combinators.
def ID(value):
    return value


def K(value):
    """The function that is always `value`."""
    return lambda _: value


TT = K(True)


def C(function):
    """A function of a pair, given one argument after the other."""
    return lambda first: lambda second: function([first, second])


def curry(function, *given, **named):
    return lambda *rest, **more: function(*given, *rest, **{**named, **more})


def COMP(functions):
    """Composition: the last function first."""
    order = list(functions)[::-1]
    return lambda value: reduce(lambda result, function: function(result), order, value)


def AA(function):
    """Applies to all elements of a list."""
    return lambda values: [function(value) for value in values]


def CONS(functions):
    """The list of what the functions give for one value."""
    return lambda value: [function(value) for function in functions]


def APPLY(pair):
    function, value = pair
    return function(value)


def IF(functions):
    """Of [test, f, g]: f of a value that passes the test, g of any other."""
    test, *branches = functions
    return lambda value: branches[0 if test(value) else 1](value)


def CASE(pairs):
    """The first function whose test holds."""
    return lambda value: next((function(value) for test, function in pairs if test(value)), None)


def LIFT(function):
    """The function of what functions give: LIFT(f)([g, h])(x) = f([g(x), h(x)])."""
    return lambda functions: lambda value: function([inner(value) for inner in functions])


def RAISE(function):
    """LIFT for lists of functions, else the function itself."""
    lifted, of_functions = LIFT(function), ISSEQOF(ISFUN)
    return lambda values: (lifted if of_functions(values) else function)(values)


def INSR(function):
    """Folds a list from the right: f([x1, f([x2, ... f([xn-1, xn])])])."""
    return lambda values: reduce(lambda later, value: function([value, later]), reversed(values))


def INSL(function):
    """Folds a list from the left: f([... f([f([x1, x2]), x3]) ..., xn])."""
    return lambda values: reduce(lambda earlier, value: function([earlier, value]), values)


def TREE(function):
    """Folds a list by halves: f([left half folded, right half folded]), the right one not the shorter."""

    def folded(values):
        def span(first, end):
            middle = (first + end) // 2
            return values[first] if end == first + 1 else function([span(first, middle), span(middle, end)])

        return span(0, len(values))

    return folded


def AS(function):
    """The list of f(v)(x) for all v of a list, as a function of x."""
    return lambda values: CONS([function(value) for value in values])


def AC(function):
    """The composition of f(v) for all v of a list."""
    return lambda values: COMP([function(value) for value in values])


def FILTER(test):
    return lambda values: [value for value in values if test(value)]


def MERGE(later):
    """Merges two sorted lists; later(a, b) tells whether a comes after b."""

    def merged(pair):
        first, second = list(pair[0]), list(pair[1])
        result = []
        while first and second:
            result.append(second.pop(0) if later(first[0], second[0]) else first.pop(0))
        return result + first + second

    return merged


# Lists.
def CAT(values):
    return (
        reduce(lambda a, b: a + b, values)
        if not _lists(values)
        else list(itertools.chain.from_iterable(values))
    )


def _lists(values):
    return (
        isinstance(values, (list, tuple)) and len(values) > 0 and all(type(value) is list for value in values)
    )


def DISTL(pair):
    return [[pair[0], value] for value in pair[1]]


def DISTR(pair):
    return [[value, pair[1]] for value in pair[0]]


def TRANS(rows):
    return [list(column) for column in zip(*rows)]


def REVERSE(values):
    return list(values)[::-1]


LEN = len


def FIRST(values):
    return values[0]


def LAST(values):
    return values[-1]


def TAIL(values):
    return values[1:]


def RTAIL(values):
    return values[:-1]


def AR(pair):
    """Appends right."""
    return pair[0] + [pair[-1]]


def AL(pair):
    """Appends left."""
    return [pair[0]] + pair[-1]


def LIST(value):
    return [value]


def SEL(n):
    return lambda values: values[int(n) - 1]


S1, S2, S3, S4, S5, S6, S7, S8, S9, S10 = (SEL(n) for n in builtins.range(1, 11))


def N(n):
    """The list of n times a value."""
    return lambda value: [value] * int(n)


def NN(n):
    """A list n times, as one list."""
    return lambda values: values * int(n)


DIESIS, DOUBLE_DIESIS = N, NN


def INTSTO(n):
    return list(builtins.range(1, int(n) + 1))


def FROMTO(pair):
    """The integers from the first to the last; none if the last is less."""
    return np.arange(int(pair[0]), int(pair[-1]) + 1).tolist()


def RANGE(pair):
    first, last = int(pair[0]), int(pair[-1])
    return (
        list(builtins.range(first, last + 1)) if last >= first else list(builtins.range(first, last - 1, -1))
    )


def SUBSEQ(pair):
    return lambda values: values[pair[0] - 1 : pair[1]]


def PROGRESSIVESUM(values):
    return list(itertools.accumulate(values))


def CART(lists):
    """All lists with one element of each list."""
    return [list(choice) for choice in itertools.product(*lists)]


def POWERSET(values):
    return [
        list(itertools.chain.from_iterable(choice))
        for choice in itertools.product(*([[v], []] for v in values))
    ]


def PERMUTATIONS(values):
    return [list(order) for order in itertools.permutations(values)]


def CHARSEQ(text):
    return list(text)


def STRING(characters):
    return "".join(characters)


def PRINT(value):
    print(value)
    return value


# Comparisons and logic.
def Eq(a, b):
    return a == b


def EQ(values):
    return all(value == values[0] for value in values)


def NEQ(values):
    return not EQ(values)


def LT(a):
    return lambda b: b < a


def LE(a):
    return lambda b: b <= a


def GT(a):
    return lambda b: b > a


def GE(a):
    return lambda b: b >= a


def ISLT(pair):
    return LT(pair[0])(pair[1])


def ISLE(pair):
    return LE(pair[0])(pair[1])


def ISGT(pair):
    return GT(pair[0])(pair[1])


def ISGE(pair):
    return GE(pair[0])(pair[1])


def BIGGER(pair):
    return max(pair[0], pair[1])


def SMALLER(pair):
    return min(pair[0], pair[1])


greater = BIGGEST = max
SMALLEST = min
And = AND = all
Or = OR = any


def Not(value):
    return not value


NOT = AA(Not)


def every(test, values):
    return all(test(value) for value in values)


# Tests of what a value is.
def ISNUM(value):
    return isinstance(value, (int, float, complex, np.number))


def NUMBER_FROM_ZERO_TO_ONE_P(value):
    return ISNUM(value) and 0 <= value <= 1


def ISFUN(value):
    return callable(value)


def ISPOL(value):
    return isinstance(value, Hpc)


is_polyhedra_complex = ISPOL


def ISNUMPOS(value):
    return ISNUM(value) and value > 0


def ISNUMNEG(value):
    return ISNUM(value) and value < 0


def ISINT(value):
    return isinstance(value, (int, np.integer))


ISLONG = ISINT


def ISINTPOS(value):
    return ISINT(value) and value > 0


def ISINTNEG(value):
    return ISINT(value) and value < 0


def ISREAL(value):
    return isinstance(value, float)


def ISREALPOS(value):
    return ISREAL(value) and value > 0


def ISREALNEG(value):
    return ISREAL(value) and value < 0


def ISCOMPLEX(value):
    return isinstance(value, complex)


def ISSEQ(value):
    return isinstance(value, list)


def ISSEQ_NOT_VOID(value):
    return ISSEQ(value) and len(value) > 0


def ISSEQOF(test):
    return lambda value: ISSEQ(value) and all(test(element) for element in value)


def ISNULL(value):
    return ISSEQ(value) and len(value) == 0


def ISBOOL(value):
    return isinstance(value, bool)


def ISPAIR(value):
    return ISSEQ(value) and len(value) == 2


def ISCHAR(value):
    return isinstance(value, str) and len(value) == 1


def ISSTRING(value):
    return isinstance(value, str)


def ISEVEN(n):
    return ISINT(n) and n % 2 == 0


def ISODD(n):
    return ISINT(n) and n % 2 == 1


def ISNAT(n):
    return ISINT(n) and n >= 0


def ISZERO(n):
    return n == 0


ISREALVECT = ISSEQOF(ISREAL)
ISFUNVECT = ISSEQOF(ISFUN)


def ISVECT(value):
    return ISREALVECT(value) or ISFUNVECT(value)


ISPOINT = ISVECT


def ISPOINTSEQ(value):
    return ISSEQOF(ISPOINT)(value) and len({len(point) for point in value}) <= 1


def ISMAT(value):
    """Whether a value is a list of lists that are equally long."""
    return ISSEQOF(ISSEQ)(value) and len({len(row) for row in value}) <= 1


def ISSQRMAT(value):
    return ISMAT(value) and len(value) == len(value[0])


def ISMATOF(test):
    return lambda value: ISMAT(value) and all(test(element) for row in value for element in row)


def IS_PLASM_POINT_2D(value):
    return ISPAIR(value)


# Vectors and matrices.
def VECTSUM(vectors):
    return [sum(values) for values in zip(*vectors)]


def VECTDIFF(vectors):
    """The first vector less all others."""
    return [head - sum(rest) for head, *rest in zip(*vectors)]


def MEANPOINT(points):
    """The mean of points: of each coordinate."""
    return np.mean(np.array(points, float), axis=0).tolist()


def VECTPROD(pair):
    """The cross product of two vectors of three coordinates; missing ones are 0."""
    a, b = (list(map(float, vector)) + [0.0] * (3 - len(vector)) for vector in pair)
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def VECTNORM(vector):
    return math.sqrt(sum(value * value for value in vector))


def UNITVECT(vector):
    """The vector of length 1 in a direction; what has no direction stays."""
    norm = VECTNORM(vector)
    return [value / norm if norm else float(value) for value in vector]


def INNERPROD(pair):
    return sum(a * b for a, b in zip(*pair))


def SCALARVECTPROD(pair):
    """A vector times a number, which may come first or last."""
    return np.multiply(*pair).tolist()


def MIXEDPROD(triple):
    """The signed volume of the box that three vectors span."""
    return float(np.linalg.det(np.array(triple, float)))


def DIRPROJECT(direction):
    """The part of vectors along a direction."""
    unit = np.array(UNITVECT(direction))
    return lambda vector: (unit @ np.array(vector, float) * unit).tolist()


def ORTHOPROJECT(direction):
    """The part of vectors across a direction."""
    unit = np.array(UNITVECT(direction))
    across = np.eye(len(unit)) - np.outer(unit, unit)
    return lambda vector: (across @ vector).tolist()


def IDNT(n):
    """The unit matrix."""
    return np.eye(n, dtype=int).tolist()


def INV(matrix):
    """The inverse of a matrix; of a singular one all entries are nan, as where pyplasm divides by zero. It is
    singular if single precision, which pyplasm computes in, cannot tell it from one that is."""
    matrix = np.array(matrix, float)
    lengths = np.abs(matrix).max(axis=1, keepdims=True)
    regular = np.isfinite(lengths).all() and lengths.all()
    if not regular or np.linalg.svd(matrix / lengths, compute_uv=False).min() < 1e-7:
        return np.full(matrix.shape, np.nan).tolist()
    return np.linalg.inv(matrix).tolist()


def TRACE(matrix):
    return np.trace(matrix).item()


def MATHOM(matrix):
    """The homogeneous form of a matrix: a first row and column more."""
    result = np.eye(len(matrix) + 1, dtype=np.asarray(matrix).dtype)
    result[1:, 1:] = matrix
    return result.tolist()


def SCALARMATPROD(pair):
    return np.multiply(*pair).tolist()


def MATDOTPROD(pair):
    """The sum of the products of entries of two matrices."""
    return np.vdot(*pair).item()


def ORTHO(matrix):
    """The symmetric part of a matrix."""
    return (np.add(matrix, np.transpose(matrix)) / 2).tolist()


def SKEW(matrix):
    """The skew-symmetric part of a matrix."""
    return (np.subtract(matrix, np.transpose(matrix)) / 2).tolist()


def VECT2MAT(vector):
    """The diagonal matrix of a vector."""
    return np.diag(vector).tolist()


def VECT2DTOANGLE(vector):
    """The angle from the first axis to a plane vector, above -PI and up to PI."""
    return math.atan2(vector[1] + 0.0, vector[0])  # + 0.0: below the axis is what is, -0.0 is not


def SPLIT_2PI(n):
    """The angles of n equal parts of a turn."""
    return np.linspace(0, 2 * PI, int(n), endpoint=False).tolist()


def ARC(pair):
    """Hundredths of degrees, the sum of two, in radians."""
    return math.radians(sum(pair) / 100)


def DIV(values):
    return reduce(lambda a, b: a / float(b), values)
