"""bsp2-profile on profiles that are known: what it says is lost, by the line, and that what it draws is a picture.

    profile_test.py TOOL FOLDER
"""
import pathlib
import random
import subprocess
import sys
import xml.etree.ElementTree as xml

tool, folder = sys.argv[1], pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
HEAD = "superstep\trank\tbegin_s\tw_s\twait_s\tsync_s\th_out_bytes\th_in_bytes\tmessages_out\tmessages_in\tgh_s\tl_s\tplace\n"


def profile(name, ranks, works, places):
    """works[superstep][rank] seconds of work; each sync takes 1 ms after the slowest has come."""
    now, text = 0.0, f"# bsp2 profile 1\n# program {name}\n# ranks {ranks}\n" + HEAD
    for step, (work, place) in enumerate(zip(works, places)):
        for rank, w in enumerate(work):
            wait = max(work) - w
            text += f"{step}\t{rank}\t{now:.9f}\t{w:.9f}\t{wait:.9f}\t{wait + 0.001:.9f}\t8\t8\t1\t1\t-\t-\t{place}\n"
        now += max(work) + 0.001
    path = folder / f"{name}.tsv"
    path.write_text(text)
    return path


def run(*arguments, code=0):
    done = subprocess.run([sys.executable, tool, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done.stdout + done.stderr


def rectangles(path, color):
    """(x, y, width, height) of the marks of a colour, the legend's left out."""
    root = xml.fromstring(path.read_text())
    all_of = [[float(r.get(k)) for k in ("x", "y", "width", "height")] for r in root.iter("{http://www.w3.org/2000/svg}rect")
              if r.get("fill") == color]
    return [r for r in all_of if r[2:] != [12.0, 12.0]]


# Two lines; at b.c:2 process 1 works four times as long as the others.
works = [[0.1, 0.1, 0.1], [0.1, 0.4, 0.1], [0.1, 0.4, 0.1], [0.2, 0.2, 0.2]]
path = profile("known", 3, works, ["a.c:1", "b.c:2", "b.c:2", "a.c:1"])
text = run(path, "-o", folder / "known.svg")
lines = [line.split() for line in text.splitlines()]
assert "4 supersteps of 3 processes" in text and "400 ms of the work are lost to waiting (36 %)" in text, text
assert lines[2][:2] == ["400", "ms"] and lines[2][-1] == "b.c:2" and "1 (100 %)" in text.splitlines()[2], text
assert lines[3][0] == "0" and lines[3][-1] == "a.c:1", text
# Of the 1.104 s of each process the picture shows 0.5, 1.1 and 0.5 s of work: areas of the timeline are seconds.
work = [r for r in rectangles(folder / "known.svg", "#4477aa") if r[1] < 200]
total = sum(w * h for _, _, w, h in work)
expected = (0.5 + 1.1 + 0.5) / 1.104 * (1080 - 90 - 20) * 36
assert abs(total - expected) < 0.01 * expected, (total, expected)

# Any number of supersteps and processes, also of no duration, makes a picture; times add up.
seed = random.randrange(2**32)
for ranks, steps in ((1, 1), (1, 1000), (40, 3), (7, 1200), (2, 130)):
    chance = random.Random(seed + ranks * steps)
    works = [[chance.choice((0.0, chance.expovariate(1000))) for _ in range(ranks)] for _ in range(steps)]
    places = [f"<&\"{chance.randrange(40)}.c:7" for _ in range(steps)]
    path = profile("random", ranks, works, places)
    text = run(path, "-o", folder / "random.svg")
    lost = sum(max(work) - sum(work) / ranks for work in works)
    share = round(100 * lost / (sum(map(max, works)) or 1e-9))
    assert f"lost to waiting ({share} %)" in text, (seed, ranks, steps, text)
    assert rectangles(folder / "random.svg", "#4477aa") or not any(map(any, works)), (seed, ranks, steps)
    run(path)
    assert pathlib.Path(f"{path}.html").read_text().startswith("<!DOCTYPE html>")

# A run that was killed: the rows of a superstep that are there in part do not count.
broken = path.read_text()
cut = folder / "cut.tsv"
cut.write_text(broken[: broken.rstrip("\n").rindex("\n") + 1])
assert "129 supersteps of 2 processes" in run(cut), seed

# What is no profile.
for content, message in (("", "not a profile"), ("# bsp2 profile 1\n# ranks 2\n" + HEAD, "no complete superstep"),
                         ("# bsp2 profile 1\n# ranks 2\n" + HEAD + "0\t0\tx\n", "broken")):
    bad = folder / "bad.tsv"
    bad.write_text(content)
    assert message in run(bad, code=2), (content, message)
assert "No such file" in run(folder / "none.tsv", code=2)
