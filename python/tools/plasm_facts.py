#!/usr/bin/env python3
"""Runs programs written for pyplasm on bsp2.plasm and compares what they show to facts measured on pyplasm.

    plasm_facts.py FACTS.tsv --programs DIR [--folder LIBRARIES] [--alt-folder LIBRARIES] [--out TABLE.tsv]

The built module is found by PYTHONPATH (docs/plasm.md). DIR holds a folder OWNER+NAME for each repository,
as it is at the commit that the table names; programs that are not there are counted by themselves. Each
program runs in a process of its own, with a limit of time. Of each VIEW are compared: the box (to 1e-5),
the content of the cells of each dimension (to 1e-4), and the content of the union of the solid cells (to
1e-4), all relative to the size. A program that differs runs twice: if it differs from itself, it throws
dice.

The table knows the dimension of a cell by the rank of its points in single precision, so here, too, a cell is
flat where it is thinner than 2e-7 of the whole or 2e-5 of its own size, unless it is known to be solid. The table does
not tell its limits; its numbers of cells do (docs/plasm.md).
"""

import argparse
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
BOX, CONTENT = 1e-5, 1e-4
THICKNESS, SHARE = 2e-7, 2e-5
"""Of the diagonal of a view's box, and of the size of a cell: what is thinner is flat in single precision."""


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("facts")
    parser.add_argument("--programs", required=True)
    parser.add_argument(
        "--folder", action="append", default=[], help="modules that programs import; may be repeated"
    )
    parser.add_argument(
        "--alt-folder",
        action="append",
        default=[],
        help="the same, before all others, for programs with '+altlib' in the table; may be repeated",
    )
    parser.add_argument("--timeout", type=float, default=60)
    parser.add_argument("--only", default="", help="programs whose repository and path have this text")
    parser.add_argument("--no-unions", action="store_true")
    parser.add_argument("--every", type=int, default=1, help="each n-th program alone")
    parser.add_argument("--out", help="a table with a row for each view")
    parser.add_argument(
        "--again", help="a table of before (--out): programs that were right in it do not run again"
    )
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        return worker(json.loads(given.one))
    with open(given.facts, newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
    programs = {}
    for row in rows:
        if row["runs"] == "yes" and given.only in row["repo"] + " " + row["path"]:
            programs.setdefault((row["repo"], row["path"], row["lines"], row["seconds"]), []).append(row)
    table, absent = [], 0
    before = read_table(given.again) if given.again else {}
    for number, ((repo, path, _, _), views) in enumerate(programs.items()):
        if number % given.every:
            continue
        known = before.get((repo, path), [])
        if known and all(row[3] == "yes" and "no" not in row[4:7] for row in known):
            table += known
            continue
        file = pathlib.Path(given.programs, repo.replace("/", "+"), path)
        if not file.is_file():
            absent += 1
            table.append([repo, path, "", "absent", "", "", "", "the program is not there"])
            continue
        began = time.time()
        result = run(file, views, given)
        cells = list(compare(views, result, given))
        if result["runs"] and any("no" in row[2:5] for row in cells):
            again = run(file, views, given)
            for row in cells:
                if differs(result["views"].get(row[0]), again["views"].get(row[0])):
                    row[2:5] = ["chance" if cell == "no" else cell for cell in row[2:5]]
        result["seconds"] = time.time() - began
        table += [[repo, path, *row] for row in cells]
        bad = [
            row for row in table[-len(views) :] if "no" in row[4:7] or "chance" in row[4:7] or row[3] == "no"
        ]
        print(f"{'ok ' if not bad else 'BAD'} {result['seconds']:6.1f} s  {repo}  {path}", flush=True)
        for row in bad:
            print("       ", *row[2:], flush=True)
    if given.out:
        with open(given.out, "w") as out:
            out.write("repo\tpath\tview\truns\tbox\tsums\tunion\tremark\n")
            out.writelines("\t".join(map(str, row)) + "\n" for row in table)
    summary(table)
    return 0


def read_table(path):
    """The rows of a table, by program."""
    rows = {}
    with open(path) as file:
        for line in file.read().splitlines()[1:]:
            row = line.split("\t")
            rows.setdefault((row[0], row[1]), []).append(row)
    return rows


def run(file, views, given):
    """What a program shows: {"runs", "why", "views"}."""
    unions = [row["view"] for row in views if row["union_solid"] and not given.no_unions]
    with tempfile.TemporaryDirectory() as folder:
        task = {
            "file": str(file),
            "floor": "py2div" in views[0]["mode"],
            "folders": [
                os.path.abspath(folder)
                for folder in given.alt_folder * ("+altlib" in views[0]["mode"]) + given.folder
            ],
            "unions": unions,
            "out": os.path.join(folder, "views.json"),
        }
        places = os.environ.get("PYTHONPATH", "").split(os.pathsep)  # programs run in folders of their own
        environment = dict(
            os.environ,
            BSP2_VIEW="none",
            MPLBACKEND="Agg",
            PYTHONPATH=os.pathsep.join(os.path.abspath(place) for place in places if place),
        )
        command = [
            sys.executable,
            str(HERE / "plasm_facts.py"),
            "-",
            "--programs",
            "-",
            "--one",
            json.dumps(task),
        ]
        try:
            done = subprocess.run(
                command,
                cwd=file.parent,
                env=environment,
                timeout=given.timeout,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
            )
            why = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
            runs = done.returncode == 0
        except subprocess.TimeoutExpired:
            runs, why = False, [f"longer than {given.timeout:g} s"]
        shown = []
        if os.path.exists(task["out"]):
            with open(task["out"]) as lines:
                shown = [json.loads(line) for line in lines]
    return {"runs": runs, "why": "" if runs else why[0], "views": {view["view"]: view for view in shown}}


def worker(task):
    """Runs one program, and writes a line for each view."""
    from bsp2 import plasm
    from bsp2.plasm import appearance
    from bsp2.plasm.run import run as run_program

    out = open(task["out"], "w")
    count = 0

    def record(name, pol):
        box = pol.box()
        size = 0.0 if box is None else math.dist(*box)
        measures = pol.measures(THICKNESS * size, SHARE)
        entry = {"view": name, "measures": {r: m for r, (_, m) in measures.items()}}
        entry["box"] = None if box is None else [box[0].tolist(), box[1].tolist()]
        entry["cells"] = {r: n for r, (n, _) in measures.items()}
        if name in task["unions"]:
            try:
                entry["union"] = plasm.VOLUME(pol)
            except Exception as error:
                entry["union_error"] = str(error)
        out.write(json.dumps(entry) + "\n")
        out.flush()

    def viewer(pol):
        nonlocal count
        record(str(count), pol)
        count += 1
        return True

    appearance.viewers.append(viewer)
    try:
        names = run_program(task["file"], task["floor"], None, task["folders"])
    except SystemExit as end:
        if end.code:
            raise
        names = {}
    if not count:
        own = [value for value in names.values() if isinstance(value, plasm.Hpc)]
        known = {id(getattr(plasm, name)) for name in plasm.__all__}
        own = [value for value in own if id(value) not in known]
        if own:
            record("last-global", own[-1])
    out.close()
    os._exit(0)


def differs(first, second):
    """Whether a program shows something else when it runs again: it throws dice."""
    if first is None or second is None or first["box"] is None or second["box"] is None:
        return False
    moved = max(abs(a - b) for p, q in zip(first["box"], second["box"]) for a, b in zip(p, q))
    sums = [
        abs(first["measures"].get(r, 0.0) - value) > 1e-6 * value for r, value in second["measures"].items()
    ]
    return moved > 1e-6 or any(sums)


def near(a, b, scale, tolerance):
    return abs(a - b) <= tolerance * max(scale, 1e-9)


def compare(views, result, given):
    for row in views:
        view = result["views"].get(row["view"])
        runs = "yes" if result["runs"] else "no"
        if not row["view"]:
            yield ["", runs, "", "", "", result["why"]]
            continue
        if view is None:
            remark = result["why"] or "no such view"
            yield [row["view"], runs, "no", "no" if row["sum_of_cells_by_dim"] else "", "", remark]
            continue
        remarks = []
        box = compare_box(row, view, remarks)
        sums = compare_sums(row, view, remarks)
        union = ""
        if row["union_solid"] and not given.no_unions:
            value = float(row["union_solid"])
            union = "yes" if "union" in view and near(view["union"], value, value, CONTENT) else "no"
            if union == "no":
                remarks.append(f"union {view.get('union', view.get('union_error'))} is {value}")
        yield [
            row["view"],
            runs,
            box,
            sums,
            union,
            "; ".join(remarks + [result["why"]] * bool(result["why"])),
        ]


def compare_box(row, view, remarks):
    if not row["bbox_min"]:
        return ""
    low, high = ([float(x) for x in row[name].split(",")] for name in ("bbox_min", "bbox_max"))
    if view["box"] is None or len(view["box"][0]) != len(low):
        remarks.append(f"box {view['box']} is {[low, high]}")
        return "no"
    scale = max(max(map(abs, low + high)), math.dist(low, high))
    fits = all(near(a, b, scale, BOX) for a, b in zip(view["box"][0] + view["box"][1], low + high))
    if not fits:
        remarks.append(f"box {view['box']} is {[low, high]}")
    return "yes" if fits else "no"


def compare_sums(row, view, remarks):
    if not row["sum_of_cells_by_dim"]:
        return ""
    wanted = {part.split(":")[0]: float(part.split(":")[1]) for part in row["sum_of_cells_by_dim"].split(";")}
    fits = True
    for r in sorted(set(wanted) | set(view["measures"])):
        if r == "0":
            continue
        a, b = view["measures"].get(r, 0.0), wanted.get(r, 0.0)
        if not near(a, b, b, CONTENT):
            fits = False
            remarks.append(f"{r}-cells {a} is {b} ({view['cells'].get(r, 0)} cells, {row['cells_by_dim']})")
    return "yes" if fits else "no"


def summary(table):
    there = [row for row in table if row[3] != "absent"]
    programs = {}
    for row in there:
        programs.setdefault((row[0], row[1]), []).append(row[3] == "yes")
    running = sum(all(runs) for runs in programs.values())
    print(f"programs  {running} of {len(programs)} run ({100 * running / max(1, len(programs)):.1f} %)")
    for column, name in ((4, "box"), (5, "sums"), (6, "union")):
        cells = [row[column] for row in table if row[column] not in ("", "chance")]
        right = sum(cell == "yes" for cell in cells)
        print(f"{name:9s} {right} of {len(cells)} views ({100 * right / max(1, len(cells)):.1f} %)")
    chance = sum("chance" in row[4:7] for row in table)
    views = [row[4:7] for row in table if row[4] and "chance" not in row[4:7]]
    right = sum("no" not in cells for cells in views)
    print(f"all three {right} of {len(views)} views ({100 * right / max(1, len(views)):.1f} %)")
    print(f"left out  {chance} views of programs that throw dice, and show something else at each run")
    absent = len(table) - len(there)
    print(f"          {absent} programs that are not there: as if the table had not named them")


if __name__ == "__main__":
    sys.exit(main())
