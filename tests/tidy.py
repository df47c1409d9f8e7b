#!/usr/bin/env python3
"""Runs clang-tidy over the sources of a configured build, as .clang-tidy says.

    tests/tidy.py BUILD [--since COMMIT] [--jobs N]

What a unity build compiles as one is read as one: its headers are read once. Each source is read for one
target alone, though several may have it. Exit code 1 if there is anything to say.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROOMS = "api|bench|bsplib|dataflow|drawing|geometry|io|jobs|meshing|model|python|supersteps|tests"
# C headers are for C: BSPlib's interface.
HEADERS = rf"{re.escape(str(ROOT))}/({ROOMS})/.*\.(hpp|cpp)$"
# What is meant: questions that are all asked rather than one after the other; sources that are included.
QUIET = ["bitwise-instead-of-logical", "missing-braces", "unused-command-line-argument", "unknown-warning-option",
         "instantiation-after-specialization"]


def units(build):
    """A command for each thing that is compiled, and the sources that are in it."""
    commands = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        file = pathlib.Path(command["file"])
        if file.suffix != ".c" and "verify_interface" not in str(file):
            commands.setdefault(file, command)
    for file, command in commands.items():
        inside = [file]
        if file.is_relative_to(build):
            inside = [pathlib.Path(name) for name in re.findall(r'#include "(/.*)"', file.read_text())]
        yield command, {source.resolve() for source in inside}


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout.split("\n")


def sources_beside(header):
    """The folder of the sources that a header is of: for ROOM/include/bsp2/ROOM/FOLDER/x.hpp it is ROOM/src/FOLDER."""
    parts = header.relative_to(ROOT).parts
    if "include" not in parts:
        return header.parent
    return ROOT / parts[0] / "src" / pathlib.Path(*parts[4:-1])


def changed_since(commit):
    """Sources that differ from those of a commit, or are new, and folders whose headers do."""
    names = git("diff", "--name-only", commit) + git("ls-files", "--others", "--exclude-standard")
    files = {(ROOT / name).resolve() for name in names if name}
    return files, {sources_beside(file) for file in files if file.suffix == ".hpp"}


def complaints(file, build):
    """What clang-tidy says of one thing that is compiled."""
    run = subprocess.run(
        ["clang-tidy-16", "-p", build / "tidy", "--quiet", f"--header-filter={HEADERS}",
         *[f"--extra-arg=-Wno-{name}" for name in QUIET], file],
        check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    if run.returncode != 0 and "error:" not in run.stdout:
        return run.stdout + run.stderr
    return run.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--since", metavar="COMMIT", help="only what changed since then")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="only what has this text in its path")
    given = parser.parse_args()
    build = given.build.resolve()
    all_units = list(units(build))
    # A source that several targets compile would be read for each of them.
    (build / "tidy").mkdir(exist_ok=True)
    (build / "tidy" / "compile_commands.json").write_text(json.dumps([command for command, _ in all_units]))
    if given.since:
        files, folders = changed_since(given.since)
        all_units = [(command, sources) for command, sources in all_units
                     if sources & files or any(source.is_relative_to(folder) for source in sources for folder in folders)]
    chosen = [command["file"] for command, _ in all_units if given.only in command["file"]]
    found = 0
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        for file, text in zip(chosen, pool.map(lambda file: complaints(file, build), chosen)):
            if text.strip():
                found += 1
                print(f"== {os.path.relpath(file, ROOT)}\n{text}", flush=True)
    print(f"clang-tidy read {len(chosen)} of {len(list(units(build)))} units; it has something to say of {found}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
