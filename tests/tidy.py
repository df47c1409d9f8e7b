#!/usr/bin/env python3
"""Runs clang-tidy over the sources of a configured build, as .clang-tidy says.

    tests/tidy.py BUILD [--since COMMIT [--cpu-minutes M]] [--jobs N]

What a unity build compiles as one is read as one: its headers are read once. Each source is read for one
target alone, though several may have it. With --cpu-minutes what changed last is read first, and what there was
no time for is told: of the processor, so that it is as much on a busy machine. Exit code 1 if there is anything to say.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import resource
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
    """What differs from a commit, by its age: sources, and folders whose headers do. 0 is not committed, or is new."""
    names = git("diff", "--name-only", "HEAD") + git("ls-files", "--others", "--exclude-standard")
    ages = {name: 0 for name in names if name}
    for age, name in enumerate(git("log", "--name-only", "--format=", f"{commit}..HEAD"), 1):
        ages.setdefault(name, age)
    differing = set(git("diff", "--name-only", commit)) | set(names)
    files = {(ROOT / name).resolve(): age for name, age in ages.items() if name in differing}
    folders = {}
    for file, age in files.items():
        if file.suffix == ".hpp":
            folder = sources_beside(file)
            folders[folder] = min(age, folders.get(folder, age))
    return files, folders


def age_of(sources, files, folders):
    """Of what changed last in something that is compiled; none if nothing has."""
    ages = [files[source] for source in sources if source in files]
    ages += [age for folder, age in folders.items() if any(source.is_relative_to(folder) for source in sources)]
    return min(ages, default=None)


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
    parser.add_argument("--cpu-minutes", type=float, default=1e9, help="no more is begun when so much is used")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="only what has this text in its path")
    given = parser.parse_args()
    build = given.build.resolve()
    all_units = list(units(build))
    # A source that several targets compile would be read for each of them.
    (build / "tidy").mkdir(exist_ok=True)
    (build / "tidy" / "compile_commands.json").write_text(json.dumps([command for command, _ in all_units]))
    chosen = [(0, command["file"]) for command, _ in all_units]
    if given.since:
        files, folders = changed_since(given.since)
        chosen = sorted((age, command["file"]) for command, sources in all_units
                        if (age := age_of(sources, files, folders)) is not None)
    chosen = [file for _, file in chosen if given.only in file]

    def has_time():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime < 60 * given.cpu_minutes

    found = late = 0
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        for file, text in zip(chosen, pool.map(lambda file: complaints(file, build) if has_time() else None, chosen)):
            if text is None:
                late += 1
            elif text.strip():
                found += 1
                print(f"== {os.path.relpath(file, ROOT)}\n{text}", flush=True)
    print(f"clang-tidy read {len(chosen) - late} of {len(all_units)} units; it has something to say of {found}")
    if late:
        print(f"no time was left for {late} that changed, too; ./bsp2-test tidy reads all")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
