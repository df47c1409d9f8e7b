#!/bin/bash
# Opens every kind of output in the real ParaView: no error, no warning, and the volumes are those of the report.
#
#   paraview_test.sh BSP2 SOURCE_DIR PARAVIEW_CHECK
#
# Exit code 77: skipped.
set -uo pipefail
bsp2=$1 source=$2 check=$3
if [[ ! -x $check ]]; then echo "skipped: needs paraview-check"; exit 77; fi
folder=$(mktemp -d /tmp/bsp2-paraview-XXXXXX)
trap 'rm -rf "$folder"' EXIT
model=$source/examples/mechanical_piece.csg
for kind in vtp ply obj stl; do
  "$bsp2" run "$model" --regions 8 -o "$folder/out" --boundary "$folder/out/boundary.$kind" --quiet || exit 1
done
"$bsp2" run "$model" --regions 8 -o "$folder/tets" --tets --quiet || exit 1
"$bsp2" run "$model" --regions 8 --series "$folder/series.pvd" --budget 20ms --quiet || exit 1

# The first call on a machine installs ParaView, which takes its time, and is no matter of ours where it cannot.
timeout 600 "$check" "$folder/out/solid.pvtu" >"$folder/first.log" 2>&1
if (($? == 124)) || grep -q -E 'cannot (install|download)' "$folder/first.log"; then
  echo "skipped: ParaView cannot be installed here"
  exit 77
fi

python3 - "$folder" "$check" <<'PYTHON'
import glob, json, subprocess, sys

folder, check = sys.argv[1:]
report = json.load(open(folder + "/out/report.json"))
truth = report["volume"]["in"]
failed = False

def opened(path):
    global failed
    ended = subprocess.run([check, path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=200)
    found = json.loads(ended.stdout) if ended.returncode == 0 else {}
    ok = ended.returncode == 0 and found["cells"] > 0 and not ended.stderr.strip() and not found.get("warnings")
    print(path[len(folder) + 1:], "opened" if ok else "FAILED: " + ended.stderr + str(found.get("warnings")), found.get("cells"))
    failed = failed or not ok
    return found

def expect(what, value, wanted, tolerance):
    global failed
    ok = abs(value - wanted) <= tolerance * abs(wanted)
    print("  ", what, value, "" if ok else "FAILED: wanted %r" % wanted)
    failed = failed or not ok

def volume(found):
    return abs(found.get("volume_faces") or found["volume"])

opened(folder + "/series.pvd")
for name, tolerance in (("out/solid.pvtu", 1e-6), ("tets/solid.pvtu", 1e-6)):
    found = opened(folder + "/" + name)
    if found:
        expect("volume", volume(found), truth, tolerance)
pieces = sorted(glob.glob(folder + "/out/solid_*.vtu"))
assert pieces
expect("volume of the pieces", sum(volume(opened(piece)) for piece in pieces), truth, 1e-6)
for kind in ("vtp", "ply", "obj", "stl"):
    found = opened(folder + "/out/boundary." + kind)
    if found:
        expect("triangles", found["cells"], report["boundary"]["triangles"], 0)
        low, high = report["bounds"]
        for axis in range(3):
            expect("bounds", found["bounds"][2 * axis], low[axis], 1e-5) if low[axis] else None
            expect("bounds", found["bounds"][2 * axis + 1], high[axis], 1e-5) if high[axis] else None
sys.exit(1 if failed else 0)
PYTHON
