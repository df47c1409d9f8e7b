#!/bin/bash
# Runs the shipped batch scripts on a Slurm of several virtual nodes on this machine. Each story ends with the digest of a plain run.
#
#   slurm_test.sh BSP2 SOURCE_DIR LOCAL_SLURM signal | failure | array
#
# Exit code 77: skipped. The daemons are ended whatever happens.
set -uo pipefail
bsp2=$1 source=$2 local_slurm=$3 story=$4

if [[ -z ${BSP2_SLURM_FOLDER:-} ]]; then  # outside: the daemons, a limit of time, and cleaning up
  if [[ ! -x $local_slurm || $EUID != 0 ]]; then echo "skipped: needs local-slurm, and root"; exit 77; fi
  folder=$(mktemp -d /tmp/bsp2-slurm-XXXXXX) && chmod 755 "$folder"  # munge asks for it
  export BSP2_SLURM_FOLDER=$folder LOCAL_SLURM_DIR=$folder/slurm LOCAL_SLURM_PORT=$((20000 + RANDOM % 10000))
  # shellcheck disable=SC2317  # a trap calls it
  finish() { timeout 60 "$local_slurm" down; rm -rf "$folder"; }
  trap finish EXIT
  trap 'exit 1' INT TERM HUP
  if ! timeout 200 "$local_slurm" up --nodes 3 --cpus 2; then echo "skipped: Slurm does not start here"; exit 77; fi
  eval "$("$local_slurm" env)"
  timeout --kill-after=5 "${BSP2_SLURM_SECONDS:-400}" "$0" "$@" &
  wait $!
  exit
fi

folder=$BSP2_SLURM_FOLDER
cd "$folder" || exit 1
export BSP2=$bsp2

fail() {
  echo "FAILED: $*"
  squeue -a
  scontrol show job
  grep -i -E "requeue|error" "$folder"/slurm/log/slurmctld.log | tail -n 20
  tail -n 20 "$folder"/slurm-*.out
  exit 1
}

digest() { sed -n 's/.*"digest": *"\([0-9a-f]*\)".*/\1/p' "$1/report.json"; }

restarts() { scontrol show job -o "$1" | grep -o 'Restarts=[0-9]*' | head -1 | cut -d= -f2; }

# Requeued jobs wait two minutes for their turn, for the nodes to recover; here a few seconds do. Not none: a node refuses a job
# that comes back in the second in which it was ended there.
declare -A hurried
hurry() {
  local job turn
  for job in $(squeue -h -t PD -o '%i %r' | sed -n 's/ BeginTime$//p'); do
    turn=$job.$(restarts "$job")
    [[ -z ${hurried[$turn]:-} ]] && scontrol update "jobid=$job" starttime=now+3 2>/dev/null && hurried[$turn]=1
  done
}

state_of() { scontrol show job -o "$1" 2>/dev/null | grep -o 'JobState=[A-Z_]*' | sort -u | sed 's/JobState=//'; }

# until COMMAND..: asks five times a second, for a minute and a half
until_true() {
  local i
  for ((i = 0; i < 450; ++i)); do
    if "$@"; then return 0; fi
    sleep 0.2
  done
  fail "waited too long for: $*"
}

is_over() {
  hurry
  # A job that is requeued has the state of the end of its batch script, until its node is free again: on a busy machine for seconds.
  local i state
  for ((i = 0; i < 30; ++i)); do
    state=$(state_of "$1")
    [[ $state == FAILED ]] || break
    sleep 1
  done
  case $state in COMPLETED) return 0 ;; *FAILED* | *CANCELLED* | *TIMEOUT*) fail "job $1: $state" ;; *) return 1 ;; esac
}

check() { # NAME DIR
  [[ $(digest "$2") == "$expected" ]] || fail "$1: digest $(digest "$2") instead of $expected"
  echo "ok: $1"
}

# Much of it is decided early, and it takes some seconds.
awk 'BEGIN { srand(1); print "difference() { cube(size=[20,20,20]);"
  for (i = 0; i < 2000; ++i) printf "multmatrix([[1,0,0,%f],[0,1,0,%f],[0,0,1,%f],[0,0,0,1]]) { sphere($fn=14,r=0.6); }\n", 20*rand(), 20*rand(), 20*rand()
  print "}" }' >model.csg
"$bsp2" run model.csg --regions 32 --report plain.json --quiet || fail "the plain run"
mkdir plain && mv plain.json plain/report.json
expected=$(digest plain)
[[ -n $expected ]] || fail "the plain run has no digest"

a_signal() { # as before a time limit
  local job
  job=$(sbatch --parsable "$source/slurm/one_node.sbatch" model.csg one --regions 32 --threads 1 --budget 100ms) || fail sbatch
  until_true test -f one/snapshot.h5
  scancel --signal=USR1 "$job"
  until_true is_over "$job"
  [[ $(restarts "$job") -ge 1 ]] || fail "one node: the job was over before the signal"
  check "one node, signal, requeued" one
}

a_failure() { # of a node
  local job node
  job=$(sbatch --parsable --nodes=2 "$source/slurm/many_nodes.sbatch" model.csg two --regions 32 --threads 1 --budget 100ms) || fail sbatch
  until_true test -f two/snapshot.h5
  node=$(squeue -h -j "$job" -o %N | xargs scontrol show hostnames | tail -1)
  "$local_slurm" fail "$node" || fail "nobody failed"
  until_true is_over "$job"
  [[ $(restarts "$job") -ge 1 ]] || fail "two nodes: the job was over before the node failed"
  "$local_slurm" resume "$node" || fail "the node did not come back"
  check "two nodes, one failed, requeued" two
}

an_array() { # and its merge, while a node fails
  local merge node
  "$bsp2" jobs split model.csg queue --regions 32 --job-seconds 0 || fail split
  merge=$("$source/slurm/submit_array.sh" model.csg queue three 5 --threads 1 --budget 200ms --lease 4) || fail submit_array
  until_true compgen -G 'queue/done/*.h5' >/dev/null
  node=$(squeue -h -t R -o %N | grep -v '^$' | tail -1)
  "$local_slurm" fail "$node" || fail "nobody failed"
  # The node stays away: one that just came back refuses, for two minutes, a job that it lost.
  until_true is_over "$merge"
  check "job array, a node failed, merged" three
  "$bsp2" jobs status queue | head -1
}

case $story in
  signal) a_signal ;;
  failure) a_failure ;;
  array) an_array ;;
  *) fail "no such story: $story" ;;
esac
