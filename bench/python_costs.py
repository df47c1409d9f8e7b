#!/usr/bin/env python3
"""What calls from Python cost: docs/python.md has the figures.

    PYTHONPATH=build/release/python python3 bench/python_costs.py [--evaluations 10000] [--cells 100]
"""

import argparse
import gc
import os
import signal
import subprocess
import sys
import time

import bsp2


def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--evaluations", type=int, default=10000)
    parser.add_argument("--cells", type=int, default=100, help="of a row of cubes: so many to the third in all")
    given = parser.parse_args()

    began, cpu = time.perf_counter(), time.process_time()
    cubes = [bsp2.cube().translate([2.0 * i, 0, 0]) for i in range(100_000)]
    made = time.perf_counter() - began
    print(f"100,000 moved cubes: {made:.2f} s, of which the processor took {time.process_time() - cpu:.2f} s")
    began = time.perf_counter()
    whole = bsp2.union(cubes)
    print(f"their union: {time.perf_counter() - began:.2f} s")
    del cubes, whole

    n = given.cells
    row = bsp2.product([bsp2.union(bsp2.cuboid([1]).translate([2.0 * i]) for i in range(n))] * 3) if n > 1 else bsp2.cube()
    began = time.perf_counter()
    result = row.evaluate()
    print(f"{len(result):,} cells: {time.perf_counter() - began:.1f} s")
    began = time.perf_counter()
    names = "points point_offsets face_offsets corner_offsets corners labels primitives parts regions levels volumes".split()
    arrays = {name: getattr(result, name) for name in names}
    seconds = time.perf_counter() - began
    same = all(getattr(result, name).ctypes.data == array.ctypes.data and not array.flags.owndata for name, array in arrays.items())
    total = sum(array.nbytes for array in arrays.values())
    print(f"as arrays of {total / 1e6:.0f} MB: {1e3 * seconds:.2f} ms, at the same addresses each time: {same}")
    del arrays, result, row

    model = bsp2.cuboid([4, 3, 1]) - bsp2.cylinder(h=3, r=1, fn=16).translate([2, 1.5, -1])
    for _ in range(200):
        model.evaluate(threads=1).points
    before, began = resident(), time.perf_counter()
    for _ in range(given.evaluations):
        result = model.evaluate(threads=1)
        result.points, result.surface().triangles
    seconds = time.perf_counter() - began
    print(f"{given.evaluations:,} evaluations: {1e3 * seconds / given.evaluations:.2f} ms each, {(resident() - before) / 1e3:.0f} kB more memory")

    script = (
        "import bsp2\n"
        "try: bsp2.ball(5).evaluate(tolerance=1e-4, progress=lambda n, d, c: n == 'computation' and print('now', flush=True))\n"
        "except KeyboardInterrupt: print('stopped')\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        time.sleep(0.5)
        began = time.perf_counter()
        process.send_signal(signal.SIGINT)
        process.communicate()
        print(f"Ctrl-C ends a computation after {time.perf_counter() - began:.2f} s")


if __name__ == "__main__":
    main()
