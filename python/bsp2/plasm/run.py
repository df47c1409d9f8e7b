"""Runs programs written for pyplasm, also those in Python 2, and with the modules beside them.

What is translated: tabs, `print`, `xrange`, `iteritems`, `except X, e` and the like (by lib2to3, where Python
has it), and a division of integers that comes out even stays an integer. Programs that do not import pyplasm
have its names from the start.
"""

import ast
import builtins
import hashlib
import importlib
import importlib.abc
import importlib.util
import os
import re
import sys
import traceback
import types
import warnings

import bsp2

_BUILT_IN = set(dir(builtins))

LAR_MODULES = (
    "architectural boolean boolean1 boolean2 boundary hijson hospital integr inters iot3d lar lar2psm larcc "
    "largrid larlib larstruct mapper matrix morph myfont simplexn smplxn splines splitcell support sysml "
    "triangulation"
).split()
"""Modules of lar-cc and larlib: where they are not found, bsp2.plasm.lar stands in for them."""


class TranslationError(SyntaxError):
    """A program that is neither in Python 3 nor in Python 2."""


def read(path):
    """The text of a source file, whatever its encoding."""
    with open(path, "rb") as file:
        data = file.read()
    for encoding in ("utf-8-sig", "latin-1"):
        try:
            text = data.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    return text.replace("\r\n", "\n").replace("\r", "\n")


def translated(text, path):
    """Code of a program, and whether it was in Python 2."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            code = compile(text, path, "exec", dont_inherit=True)
        old = _OLD_METHODS.search(text) and _two_to_three(text, ("fix_next", "fix_has_key", "fix_dict"))
        return (compile(old, path, "exec", dont_inherit=True) if old else code), False
    except (SyntaxError, ValueError) as error:
        first = error
    text = text.replace("\0", "")
    # Python 2 takes a tab as far as the next multiple of eight, but users mixed it with four spaces as well.
    for candidate in (text.expandtabs(8), text.expandtabs(4)):
        for source in (candidate, _two_to_three(candidate)):
            if source is None:
                continue
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    return _with_even_divisions(source, path), True
            except (SyntaxError, ValueError):
                continue
    raise first


_OLD_METHODS = re.compile(r"\.(next|has_key|iteritems|itervalues|iterkeys)\(")


def _two_to_three(text, only=None):
    """The text in Python 3, or None. What was translated once is kept in the user's cache: that takes
    seconds."""
    folder = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    name = hashlib.sha256(f"1 {sys.version_info[:2]} {only} {text}".encode(errors="replace")).hexdigest()
    kept = os.path.join(folder, "bsp2-plasm", name[:32] + ".py")
    try:
        with open(kept, encoding="utf-8", errors="surrogateescape") as file:
            return file.read()
    except OSError:
        pass
    result = _refactored(text, only)
    if result is not None:
        try:
            os.makedirs(os.path.dirname(kept), exist_ok=True)
            part = f"{kept}.{os.getpid()}"
            with open(part, "w", encoding="utf-8", errors="surrogateescape") as file:
                file.write(result)
            os.replace(part, kept)
        except OSError:
            pass
    return result


def _refactored(text, only):
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from lib2to3 import refactor
            from lib2to3.pgen2.parse import ParseError
            from lib2to3.pgen2.tokenize import TokenError
    except ImportError:
        if only:
            return None
        return re.sub(r"^(\s*)print +(?!\()(.*?)\s*$", r"\1print(\2)", text, flags=re.M).replace("<>", "!=")
    names = refactor.get_fixers_from_package("lib2to3.fixes")
    # map, filter, zip and range stay: pyplasm's are lists, and lists are what zip and filter become below.
    left = {
        "fix_map",
        "fix_xrange",
        "fix_import",
        "fix_urllib",
        "fix_reduce",
        "fix_callable",
        "fix_set_literal",
    }
    try:
        chosen = [
            n for n in names if n.rsplit(".", 1)[1] not in left and (not only or n.rsplit(".", 1)[1] in only)
        ]
        tool = refactor.RefactoringTool(chosen)
        return str(tool.refactor_string(text + "\n", "program"))
    except (ParseError, TokenError, IndentationError, SyntaxError):
        return None


class _Divisions(ast.NodeTransformer):
    def visit_BinOp(self, node):
        self.generic_visit(node)
        if not isinstance(node.op, ast.Div):
            return node
        call = ast.Call(ast.Name("__bsp2_divided__", ast.Load()), [node.left, node.right], [])
        return ast.copy_location(call, node)


def divided(a, b):
    """a / b; of integers an integer where it comes out even."""
    if type(a) is int and type(b) is int and b != 0 and a % b == 0:
        return a // b
    return a / b


def floored(a, b):
    """a / b as Python 2 has it."""
    return a // b if type(a) is int and type(b) is int else a / b


def _with_even_divisions(source, path):
    tree = _Divisions().visit(ast.parse(source, path))
    return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True)


def imports_pyplasm(text):
    return re.search(r"^\s*(from|import)\s+(pyplasm|bsp2)\b", text, re.M) is not None


def _have_old_scipy(text):
    """Where a program has to do with scipy: as it was, with the names of numpy."""
    if not re.search(r"\bscipy\b", text):
        return
    try:
        import numpy
        import scipy
    except ImportError:
        return
    names = [name for name in numpy.__all__ if name not in _BUILT_IN]
    for name in names:
        if name not in scipy.__dict__:
            setattr(scipy, name, getattr(numpy, name))
    scipy.__all__ = sorted(set(getattr(scipy, "__all__", [])) | set(names))


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds modules beside the program that Python 3 cannot read, and ours in the place of pyplasm and lar-
    cc."""

    def __init__(self, divide):
        self.divide = divide
        self.files = {}

    def find_spec(self, name, path=None, target=None):
        if name == "pyplasm" or name.startswith("pyplasm."):
            return importlib.util.spec_from_loader(name, self, is_package=name == "pyplasm")
        for folder in path if path is not None else sys.path:
            base = os.path.join(folder or ".", name.rsplit(".", 1)[-1])
            package = os.path.join(base, "__init__.py")
            for file, is_package in ((package, True), (base + ".py", False)):
                if os.path.isfile(file) and self._is_ours(file):
                    self.files[name] = file
                    spec = importlib.util.spec_from_file_location(
                        name, file, loader=self, submodule_search_locations=[base] if is_package else None
                    )
                    return spec
        return None

    def _is_ours(self, file):
        """Whether a module belongs to a program, not to Python or to this package."""
        own = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        places = {own, sys.prefix, sys.base_prefix, sys.exec_prefix}
        return not any(os.path.abspath(file).startswith(os.path.abspath(place) + os.sep) for place in places)

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        name = module.__name__
        if name == "pyplasm" or name.startswith("pyplasm."):
            _fill(module)
            return
        file = self.files[name]
        text = read(file)
        _have_old_scipy(text)
        code, _ = translated(text, file)
        module.__dict__["__bsp2_divided__"] = self.divide
        if module.__package__:
            module.__dict__["__builtins__"] = dict(vars(builtins), __import__=_import_in_package)
        _preload(module.__dict__, {}, python2=True)
        if name.split(".")[0] not in LAR_MODULES:
            _preload_lar(module.__dict__, text)
        exec(code, module.__dict__)


def _import_in_package(name, names=None, local_names=None, fromlist=(), level=0):
    """As Python 2 imports within a package: what lies beside a module comes first."""
    package = (names or {}).get("__package__")
    if package and level == 0 and "." not in name:
        folders = getattr(sys.modules.get(package), "__path__", [])
        if any(os.path.isfile(os.path.join(folder, name + ".py")) for folder in folders):
            return importlib.import_module("." + name, package)
    return builtins.__import__(name, names, local_names, fromlist, level)


class _LarFinder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """The last one: bsp2.plasm.lar for modules of lar-cc that are nowhere."""

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in LAR_MODULES:
            return importlib.util.spec_from_loader(name, self, is_package=True)
        return None

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        from . import lar

        _fill(module)
        members = {key: getattr(lar, key) for key in dir(lar) if not key.startswith("_")}
        try:  # lar-cc's modules hand it on to programs
            members["scipy"] = members["sp"] = importlib.import_module("scipy")
        except ImportError:
            pass
        names = list(members)
        module.__dict__.update(members)
        module.__all__ += [key for key in names if key not in module.__all__]


class _AbsentFinder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """What larlib's modules import for a few of their functions, and few have installed: there until it is
    called."""

    NAMES = ("p2t", "triangle")

    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_loader(name, self) if name in self.NAMES else None

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        def absent(*_, **__):
            raise ModuleNotFoundError(f"No module named '{module.__name__}', which larlib needs here")

        module.__all__ = []
        module.__getattr__ = lambda name: absent


def _fill(module):
    from bsp2 import plasm

    for name in plasm.__all__:
        setattr(module, name, getattr(plasm, name))
    module.__all__ = list(plasm.__all__)
    module.__path__ = []


def _preload(names, more, python2):
    if python2:
        from functools import reduce

        names.setdefault("reduce", reduce)
        names.setdefault("xrange", builtins.range)
        names.setdefault("unicode", str)
        names.setdefault("long", int)
        names.setdefault("raw_input", input)
    names.update(more)


def _preload_lar(names, text):
    """lar's names for what imports one of its modules: they moved between these from year to year."""
    from bsp2.plasm import lar

    if re.search(rf"^\s*(from|import)\s+({'|'.join(LAR_MODULES)})\b", text, re.M):
        for name in dir(lar):
            if not name.startswith("_"):
                names.setdefault(name, getattr(lar, name))


def run(path, floor=False, preload=None, folders=()):
    """Runs a program as Python would, in its folder's company, and gives its names.

    floor: integer divisions as in Python 2. preload: pyplasm's names are there from the start (default: if
    the program does not import it). folders: where modules are found, after the program's own folder.
    """
    from bsp2 import plasm

    path = os.path.abspath(path)
    text = read(path)
    code, python2 = translated(text, path)
    if floor and not python2:
        code = _with_even_divisions(text, path)
    names = {"__name__": "__main__", "__file__": path, "__builtins__": __builtins__, "__doc__": None}
    names["__bsp2_divided__"] = floored if floor else divided
    wanted = not imports_pyplasm(text) if preload is None else preload
    _preload(names, {name: getattr(plasm, name) for name in plasm.__all__} if wanted else {}, python2)
    _preload_lar(names, text)
    main = types.ModuleType("__main__")
    main.__dict__.update(names)
    before = (
        sys.modules.get("__main__"),
        list(sys.path),
        list(sys.meta_path),
        sys.argv,
        sys.getrecursionlimit(),
    )
    _have_old_scipy(text)
    finder = _Finder(names["__bsp2_divided__"])
    sys.modules["__main__"] = main
    sys.path[:0] = [os.path.dirname(path), *map(os.fspath, folders)]
    sys.meta_path.insert(0, finder)
    sys.meta_path += [_LarFinder(), _AbsentFinder()]
    sys.argv = [path]
    sys.setrecursionlimit(max(before[4], 10000))
    try:
        exec(code, main.__dict__)
        return main.__dict__
    finally:
        if before[0] is not None:
            sys.modules["__main__"] = before[0]
        sys.path[:], sys.meta_path[:], sys.argv = before[1], before[2], before[3]
        sys.setrecursionlimit(before[4])


def main(arguments=None):
    import argparse

    parser = argparse.ArgumentParser(
        prog="python3 -m bsp2.plasm",
        description="Run a program that was written for pyplasm, in Python 2 or 3.",
    )
    parser.add_argument("program", help="the program's file")
    parser.add_argument("--floor", action="store_true", help="divide integers as Python 2 does: 7 / 2 is 3")
    parser.add_argument(
        "--preload", action="store_true", help="have pyplasm's names though the program imports others"
    )
    parser.add_argument(
        "--folder", action="append", default=[], help="where modules are found too; may be repeated"
    )
    given = parser.parse_args(arguments)
    try:
        run(given.program, given.floor, True if given.preload else None, given.folder)
    except KeyboardInterrupt:
        print("bsp2.plasm: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        sys.stdout.flush()
        print(_told(error, given.program), end="", file=sys.stderr)
        return 1 if _is_ours(error) else 2
    return 0


_OWN = (os.path.dirname(bsp2.__file__) + os.sep, "<frozen ")
"""How files begin whose lines say nothing to whoever wrote the program."""


def _is_ours(error):
    """Whether the library is to blame, not the program: else it is the user's mistake."""
    if isinstance(error, bsp2.Error):
        return not error.is_users_mistake
    last = traceback.extract_tb(error.__traceback__)[-1]
    return isinstance(error, (AssertionError, MemoryError, SystemError)) and last.filename.startswith(_OWN)


def _told(error, program):
    """What went wrong, and where in the program; the lines of the library, too, if that is to blame."""
    entry = told = traceback.TracebackException.from_exception(error)
    while entry is not None and not _is_ours(error):
        entry.stack = [line for line in entry.stack if not line.filename.startswith(_OWN)]
        entry.stack = traceback.StackSummary.from_list(entry.stack) if entry.stack else None
        entry = entry.__cause__ or entry.__context__
    if told.stack is None and isinstance(error, OSError):
        return f"bsp2.plasm: {program}: {(error.strerror or str(error)).lower()}\n"
    if told.stack is None and not isinstance(error, SyntaxError):
        return f"bsp2.plasm: {program} is no program: {error}\n"
    return "".join(told.format())
