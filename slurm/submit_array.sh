#!/bin/bash
# Evaluates a model by a job array over its regions, and merges the results when all of them are there.
#
#   slurm/submit_array.sh MODEL QUEUE DIR [WORKERS [options of 'bsp2 jobs run']]
#
# QUEUE is a new folder, or one whose jobs are not done yet; MODEL is not read again then. DIR gets the files. Both are on a
# file system that all nodes see. WORKERS (default: a worker a job, at most 1000) is the size of the array. Options of sbatch
# are given by its environment: SBATCH_TIMELIMIT, SBATCH_PARTITION, ... Prints the number of the merge job, which waits for the
# array.
set -euo pipefail
model=${1:?MODEL} queue=${2:?QUEUE} dir=${3:?DIR} workers=${4:-1000}
shift $(($# < 4 ? $# : 4))
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
if [[ ! -f $queue/jobs.txt ]]; then "${BSP2:-bsp2}" jobs split "$model" "$queue" >&2; fi
jobs=$(wc -l <"$queue/jobs.txt")
last=$(((jobs < workers ? jobs : workers) - 1))
array=$(sbatch --parsable --array="0-$last" "$here/job_array.sbatch" "$queue" "$@")
sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes "$here/merge.sbatch" "$queue" "$dir"
