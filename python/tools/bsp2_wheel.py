"""Makes a wheel of the module for Python, with CMake and the standard library alone: the backend of `pip install .`.

In the wheel is the package bsp2 alone, so that it may be put anywhere. Within it, as beneath a prefix, are lib/libbsp2.so, lib/bsp2 with what that
loads, and bin/bsp2, which an entry point starts: what the components `bsp2`, `library` and `python` install to be run.

    pip install --no-build-isolation .                                            # builds in build/wheel
    pip install --no-build-isolation --config-settings build-dir=build/release .  # takes what is built there
"""

import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
DEFAULT_BUILD = "build/wheel"


def version():
    return re.search(r"^project\(bsp2 VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(), re.M)[1]


def tag():
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def run(*command):
    subprocess.run([os.fspath(word) for word in command], cwd=SOURCE, check=True)


def installed(build, prefix):
    """Builds what a wheel has, and installs it beneath a prefix; gives the folder of packages, relative to that."""
    packages = f"lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"
    if not (build / "CMakeCache.txt").exists():
        settings = {
            "CMAKE_BUILD_TYPE": "Release",
            "CMAKE_UNITY_BUILD": "ON",
            "BSP2_BUILD_TESTS": "OFF",
            "BSP2_BUILD_BENCH": "OFF",
            "BSP2_PYTHON_DIR": packages,
            "Python3_EXECUTABLE": sys.executable,
        }
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        run("cmake", "-S", SOURCE, "-B", build, *generator, *(f"-D{name}={value}" for name, value in settings.items()))
    targets = subprocess.run(["cmake", "--build", build, "--target", "help"], stdout=subprocess.PIPE, text=True, check=True)
    if "bsp2_python" not in targets.stdout:
        raise SystemExit("The module for Python cannot be built: it takes Python's headers and pybind11 (Debian: python3-dev, pybind11-dev)")
    run("cmake", "--build", build, "--parallel", "--target", "bsp2", "bsp2_library", "bsp2_python")
    for component in ("bsp2", "library", "python"):
        run("cmake", "--install", build, "--component", component, "--prefix", prefix)
    (extension,) = prefix.glob("lib*/**/bsp2/_bsp2*.so")
    if not extension.name.endswith(sysconfig.get_config_var("EXT_SUFFIX")):
        raise SystemExit(f"{build} has {extension.name}, which is for another Python than {sys.executable}")
    return extension.parents[1].relative_to(prefix)


def contents(prefix, packages):
    """Pairs of a file and its place in the wheel."""
    for file in sorted((prefix / packages).rglob("*")):
        if file.is_file():
            yield file, file.relative_to(prefix / packages)
    (library,) = (file for file in prefix.glob("lib*/**/libbsp2.so.*") if file.is_symlink())  # the name that it is loaded by
    loaded = sorted(file for file in (library.parent / "bsp2").rglob("*") if file.is_file())
    for file in (library, *loaded, prefix / "bin" / "bsp2"):
        yield file, "bsp2" / file.relative_to(prefix)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = SOURCE / (config_settings or {}).get("build-dir", DEFAULT_BUILD)
    name = f"bsp2-{version()}-{tag()}.whl"
    info = f"bsp2-{version()}.dist-info"
    readme = (SOURCE / "README.md").read_text().split("\n\n")[1]
    metadata = (
        f"Metadata-Version: 2.1\nName: bsp2\nVersion: {version()}\nRequires-Dist: numpy\nRequires-Python: >=3.9\n"
        f"Summary: Parallel solid modeling with dataflow binary space partition\n\n{readme}\n"
    )
    texts = {
        f"{info}/METADATA": metadata,
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: bsp2\nRoot-Is-Purelib: false\nTag: {tag()}\n",
        f"{info}/entry_points.txt": "[console_scripts]\nbsp2 = bsp2._products:run_program\n",
        f"{info}/LICENSE": (SOURCE / "LICENSE").read_text(),
    }
    record = []
    with tempfile.TemporaryDirectory() as folder:
        prefix = pathlib.Path(folder, "prefix")
        packages = installed(build, prefix)
        with zipfile.ZipFile(pathlib.Path(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:

            def add(place, data, mode):
                entry = zipfile.ZipInfo(str(place))
                entry.external_attr = (0o100000 | mode) << 16
                entry.compress_type = zipfile.ZIP_DEFLATED
                wheel.writestr(entry, data, compresslevel=1)  # it is unpacked at once
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                record.append(f"{place},sha256={digest},{len(data)}")

            for file, place in contents(prefix, packages):
                add(place, file.read_bytes(), file.stat().st_mode & 0o777)
            for place, text in texts.items():
                add(place, text.encode(), 0o644)
            record.append(f"{info}/RECORD,,")
            wheel.writestr(f"{info}/RECORD", "\n".join(record) + "\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    name = f"bsp2-{version()}"
    run(
        "git", "archive", "--format=tar.gz", f"--prefix={name}/", "-o", pathlib.Path(sdist_directory).resolve() / f"{name}.tar.gz", "HEAD"
    )
    return f"{name}.tar.gz"
