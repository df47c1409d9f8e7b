#!/usr/bin/env python3
"""bsp2-profile: draws what each superstep of a BSP program cost each process, and where the balance is lost.

    BSP2_PROFILE=FILE mpirun -n 4 ./program
    bsp2-profile FILE [-o PICTURE.html|PICTURE.svg]

Reads the rows that the layer writes (docs/bsplib.md), needs the standard library of Python alone.
"""
import argparse
import html
import sys
from collections import defaultdict

WORK, WAIT, COMMUNICATION, MODEL, TEXT, FAINT = "#4477aa", "#ee6677", "#ccbb44", "#444444", "#222222", "#888888"
WIDTH, LEFT, RIGHT = 1080, 90, 20
MOST_COLUMNS = WIDTH - LEFT - RIGHT
NUMBERS = ("superstep", "rank", "h_out_bytes", "h_in_bytes", "messages_out", "messages_in")
SECONDS = ("begin_s", "w_s", "wait_s", "sync_s")


class ProfileError(Exception):
    """The file is no profile, or a broken one."""


class Superstep:
    """One superstep of all processes. w, wait and sync are lists by process; all times in seconds."""

    def __init__(self, number, rows):
        self.number = number
        self.begin = [row["begin_s"] for row in rows]
        self.w = [row["w_s"] for row in rows]
        self.wait = [row["wait_s"] for row in rows]
        self.sync = [row["sync_s"] for row in rows]
        self.places = [row["place"] for row in rows]
        self.h = max(max(row["h_out_bytes"], row["h_in_bytes"]) for row in rows)
        self.model = None if rows[0]["gh_s"] is None else rows[0]["gh_s"] + rows[0]["l_s"]

    @property
    def slowest(self):
        return max(range(len(self.w)), key=lambda rank: self.w[rank])

    @property
    def lost(self):
        """Seconds that the average process did not work while the slowest one did."""
        return sum(max(self.w) - w for w in self.w) / len(self.w)


class Profile:
    def __init__(self, path):
        self.program, self.supersteps = "?", []
        with open(path, encoding="utf-8", errors="replace") as file:
            lines = file.read().splitlines()
        if not lines or not lines[0].startswith("# bsp2 profile 1"):
            raise ProfileError(f"{path}: not a profile of a BSP program: its first line is not '# bsp2 profile 1'")
        settings = dict(line[2:].split(" ", 1) for line in lines if line.startswith("# ") and " " in line[2:])
        self.program = settings.get("program", "?")
        table = [line.split("\t") for line in lines if line and not line.startswith("#")]
        try:
            self.ranks = int(settings["ranks"])
            self._read(table)
        except (KeyError, ValueError, IndexError) as error:
            raise ProfileError(f"{path}: a row is broken or missing ({error})") from error
        if not self.supersteps:
            raise ProfileError(f"{path}: there is no complete superstep in it; did the program end before bsp_end?")

    def _read(self, table):
        names, rows = table[0], defaultdict(list)
        for cells in table[1:]:
            row = dict(zip(names, cells, strict=True))
            for name in NUMBERS:
                row[name] = int(row[name])
            for name in SECONDS:
                row[name] = float(row[name])
            for name in ("gh_s", "l_s"):
                row[name] = None if row[name] == "-" else float(row[name])
            rows[row["superstep"]].append(row)
        for number in sorted(rows):
            of_ranks = sorted(rows[number], key=lambda row: row["rank"])
            if len(of_ranks) == self.ranks:  # the last one may be cut off
                self.supersteps.append(Superstep(number, of_ranks))

    def by_place(self):
        """What the syncs of each line of the source cost, the most expensive first."""
        places = {}
        for step in self.supersteps:
            place = places.setdefault(step.places[step.slowest], PlaceCost(step.places[step.slowest], self.ranks))
            place.add(step)
        return sorted(places.values(), key=lambda place: -place.lost)


class PlaceCost:
    def __init__(self, place, ranks):
        self.place, self.count, self.lost, self.w, self.communication = place, 0, 0.0, 0.0, 0.0
        self.h, self.model, self.slowest = 0, 0.0, [0] * ranks

    def add(self, step):
        self.count += 1
        self.lost += step.lost
        self.w += max(step.w)
        self.communication += min(sync - wait for sync, wait in zip(step.sync, step.wait))
        self.h += step.h
        self.model = None if self.model is None or step.model is None else self.model + step.model
        self.slowest[step.slowest] += 1

    def culprit(self):
        """The process that most often let the others wait, and how often."""
        rank = max(range(len(self.slowest)), key=lambda rank: self.slowest[rank])
        return rank, self.slowest[rank] / self.count


def spoken(seconds):
    """A time with a unit that suits it."""
    for unit, scale in (("s", 1), ("ms", 1e3), ("us", 1e6)):
        if abs(seconds) * scale >= 1:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.2g} us" if seconds >= 0.5e-9 else "0"


def spoken_bytes(count):
    for unit in ("B", "KiB", "MiB", "GiB"):
        if count < 1024 or unit == "GiB":
            return f"{count:.3g} {unit}" if count >= 1000 or unit != "B" else f"{count:.0f} B"
        count /= 1024
    return ""


class Drawing:
    def __init__(self):
        self.parts, self.height = [], 0

    def rect(self, x, y, width, height, color, title=""):
        tip = f"<title>{html.escape(title)}</title>" if title else ""
        self.parts.append(f'<rect x="{x:.2f}" y="{y:.2f}" width="{max(width, 0):.2f}" height="{max(height, 0):.2f}" '
                          f'fill="{color}">{tip}</rect>')

    def line(self, x1, y1, x2, y2, color=FAINT, width=1.0):
        self.parts.append(f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" stroke="{color}" '
                          f'stroke-width="{width}"/>')

    def text(self, x, y, words, size=12, anchor="start", color=TEXT, bold=False):
        weight = ' font-weight="bold"' if bold else ""
        self.parts.append(f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size}" text-anchor="{anchor}" fill="{color}"{weight}>'
                          f"{html.escape(words)}</text>")

    def svg(self):
        return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{self.height:.0f}" '
                f'viewBox="0 0 {WIDTH} {self.height:.0f}" font-family="sans-serif">'
                f'<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(self.parts) + "\n</svg>\n")


def steps_of(most):
    """Marks of an axis from 0 to `most`: 1, 2 or 5 times a power of ten, four to nine of them."""
    step = 1e-9
    while most / step > 9:
        for factor in (2, 2.5, 2):
            step *= factor
            if most / step <= 9:
                break
    return [i * step for i in range(int(most / step) + 1)]


class Spans:
    """The time of one process, cut into columns of the picture: how much of each is work, waiting, communication."""

    def __init__(self, columns, begin, end):
        self.scale, self.begin = columns / (end - begin), begin
        self.parts = [[0.0, 0.0, 0.0] for _ in range(columns)]

    def add(self, kind, begin, seconds):
        at, end = (begin - self.begin) * self.scale, (begin + seconds - self.begin) * self.scale
        while at < end - 1e-9:
            column = min(int(at), len(self.parts) - 1)
            until = end if column == len(self.parts) - 1 else min(end, column + 1)
            self.parts[column][kind] += until - at
            at = until

    def runs(self):
        """(first column, number, shares): neighbours that look alike are one."""
        first = 0
        for i in range(1, len(self.parts) + 1):
            if i == len(self.parts) or any(abs(a - b) > 0.004 for a, b in zip(self.parts[i], self.parts[first])):
                yield first, i - first, self.parts[first]
                first = i


def draw_timeline(drawing, profile, top):
    steps = profile.supersteps
    begin = min(steps[0].begin)
    end = max(b + w + s for step in steps for b, w, s in zip(step.begin, step.w, step.sync))
    height = max(10, min(36, 320 // profile.ranks))
    drawing.text(LEFT, top, "The time of each process", 14, bold=True)
    for i, (color, words) in enumerate(((WORK, "work"), (WAIT, "waits for slower processes"), (COMMUNICATION, "communication"))):
        drawing.rect(LEFT + 220 + 190 * i, top - 10, 12, 12, color)
        drawing.text(LEFT + 238 + 190 * i, top, words)
    top += 14
    bottom = top + profile.ranks * (height + 4)
    for mark in steps_of(end - begin):
        x = LEFT + mark / (end - begin) * MOST_COLUMNS
        drawing.line(x, top, x, bottom + 4, "#dddddd")
        drawing.text(x, bottom + 17, spoken(mark), 11, "middle", FAINT)
    for rank in range(profile.ranks):
        y = top + rank * (height + 4)
        if rank % max(1, 24 // (height + 4)) == 0:
            drawing.text(LEFT - 8, y + height / 2 + 4, f"process {rank}", 11, "end")
        spans = Spans(MOST_COLUMNS, begin, end)
        for step in steps:
            came = step.begin[rank] + step.w[rank]
            spans.add(0, step.begin[rank], step.w[rank])
            spans.add(1, came, step.wait[rank])
            spans.add(2, came + step.wait[rank], max(step.sync[rank] - step.wait[rank], 0.0))
        for column, count, shares in spans.runs():
            at = y
            for share, color in zip(shares, (WORK, WAIT, COMMUNICATION)):
                drawing.rect(LEFT + column, at, count, share * height, color)
                at += share * height
    if len(steps) <= 120:  # where supersteps end
        for step in steps:
            x = LEFT + (max(b + w + s for b, w, s in zip(step.begin, step.w, step.sync)) - begin) / (end - begin) * MOST_COLUMNS
            drawing.line(x, top - 3, x, bottom, MODEL, 0.6)
    return bottom + 44


def draw_balance(drawing, profile, top):
    """Bars by superstep: the work of the slowest process, of which the average one works the lower part."""
    steps, height = profile.supersteps, 150
    per_bar = -(-len(steps) // 240)
    groups = [steps[i:i + per_bar] for i in range(0, len(steps), per_bar)]
    most = max(sum(max(s.w) + (s.model or 0) for s in group) for group in groups) or 1e-9
    what = "Each superstep" if per_bar == 1 else f"{per_bar} supersteps a bar"
    drawing.text(LEFT, top, f"{what}: work of the slowest process", 14, bold=True)
    for x, color, words in ((340, WORK, "the average process works"), (540, WAIT, "lost: it waits"), (660, COMMUNICATION, "g h + l")):
        drawing.rect(LEFT + x, top - 10, 12, 12, color)
        drawing.text(LEFT + x + 18, top, words)
    top += 16
    for mark in steps_of(most):
        y = top + height * (1 - mark / most)
        drawing.line(LEFT, y, WIDTH - RIGHT, y, "#dddddd")
        drawing.text(LEFT - 8, y + 4, spoken(mark), 11, "end", FAINT)
    width = MOST_COLUMNS / len(groups)
    for i, group in enumerate(groups):
        mean, lost, model = (sum(values) for values in zip(*[(max(s.w) - s.lost, s.lost, s.model or 0.0) for s in group]))
        x, y = LEFT + i * width, top + height
        worst = max(group, key=lambda s: s.lost)
        tip = (f"superstep {group[0].number}" + (f" to {group[-1].number}" if per_bar > 1 else "") +
               f"\nwork of the slowest {spoken(mean + lost)}, of the average {spoken(mean)}\nslowest: process {worst.slowest}, "
               f"{worst.places[worst.slowest]}\nh = {spoken_bytes(max(s.h for s in group))}")
        for value, color in ((mean, WORK), (lost, WAIT), (model, COMMUNICATION)):
            y -= value / most * height
            drawing.rect(x + 0.5, y, min(width - 1, 40) if width > 3 else width, value / most * height, color, tip)
    for i in range(0, len(groups), max(1, len(groups) // 12)):
        drawing.text(LEFT + (i + 0.5) * width if width < 41 else LEFT + i * width + 20, top + height + 15,
                     str(groups[i][0].number), 11, "middle", FAINT)
    return top + height + 48


def table(profile):
    total = sum(max(step.w) + min(s - w for s, w in zip(step.sync, step.wait)) for step in profile.supersteps) or 1e-9
    rows = [("lost", "of all", "syncs", "w", "communication", "g h + l", "h", "slowest process", "superstep ends at")]
    for cost in profile.by_place():
        rank, share = cost.culprit()
        rows.append((spoken(cost.lost), f"{100 * cost.lost / total:.1f} %", str(cost.count), spoken(cost.w), spoken(cost.communication),
                     "-" if cost.model is None else spoken(cost.model), spoken_bytes(cost.h), f"{rank} ({100 * share:.0f} %)", cost.place))
    return rows


COLUMNS = (70, 130, 180, 260, 360, 440, 520, 640)


def draw_table(drawing, rows, top, most=25):
    drawing.text(LEFT, top, "Where the balance is lost: by the line where the superstep ends", 14, bold=True)
    top += 22
    for i, row in enumerate(rows[:most + 1]):
        for x, cell in zip(COLUMNS, row):
            drawing.text(LEFT + x, top, cell, 12, "end", FAINT if i == 0 else TEXT)
        drawing.text(LEFT + 660, top, shortened(row[-1]), 12, color=FAINT if i == 0 else TEXT)
        top += 18
        if i == 0:
            drawing.line(LEFT, top - 13, WIDTH - RIGHT, top - 13)
    if len(rows) > most + 1:
        drawing.text(LEFT, top, f"and {len(rows) - most - 1} more", 12, color=FAINT)
        top += 18
    return top


def shortened(place, most=48):
    return place if len(place) <= most else "..." + place[-most + 3:]


def summary(profile):
    steps = profile.supersteps
    w, lost = sum(max(step.w) for step in steps), sum(step.lost for step in steps)
    communication = sum(min(s - a for s, a in zip(step.sync, step.wait)) for step in steps)
    count = "1 superstep" if len(steps) == 1 else f"{len(steps)} supersteps"
    processes = "1 process" if profile.ranks == 1 else f"{profile.ranks} processes"
    return (f"{profile.program}: {count} of {processes}; work of the slowest {spoken(w)}, communication {spoken(communication)}; "
            f"{spoken(lost)} of the work are lost to waiting ({100 * lost / (w or 1e-9):.0f} %)")


def draw(profile):
    drawing = Drawing()
    drawing.text(LEFT, 28, summary(profile), 14)
    top = draw_timeline(drawing, profile, 62)
    top = draw_balance(drawing, profile, top)
    drawing.height = draw_table(drawing, table(profile), top) + 12
    return drawing.svg()


def print_table(rows, most=25):
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    for row in rows[:most + 1]:
        print("  ".join(cell.rjust(width) for cell, width in zip(row, widths)) + "  " + row[-1])
    if len(rows) > most + 1:
        print(f"and {len(rows) - most - 1} more")


def main():
    parser = argparse.ArgumentParser(prog="bsp2-profile", description="Draws the profile that a BSP program wrote with BSP2_PROFILE=FILE.")
    parser.add_argument("profile", metavar="FILE")
    parser.add_argument("-o", metavar="PICTURE", help="an .html or .svg file; default: FILE.html")
    arguments = parser.parse_args()
    picture = arguments.o or arguments.profile + ".html"
    if not picture.endswith((".html", ".svg")):
        parser.error(f"{picture}: a picture ends in .html or .svg")
    try:
        profile = Profile(arguments.profile)
        drawn = draw(profile)
        if picture.endswith(".html"):
            title = html.escape(profile.program)
            drawn = f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head><body>\n{drawn}</body></html>\n'
        with open(picture, "w", encoding="utf-8") as file:
            file.write(drawn)
    except (OSError, ProfileError) as error:
        print(f"bsp2-profile: {error}", file=sys.stderr)
        return 2
    print(summary(profile))
    print_table(table(profile))
    print(f"wrote {picture}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
