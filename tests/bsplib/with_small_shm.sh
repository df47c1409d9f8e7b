#!/bin/bash
# with_small_shm.sh <megabytes> <command...>: runs it with a /dev/shm of this size. 77 if that cannot be had.
size=$1
shift
unshare -m mount -t tmpfs none /dev/shm 2>/dev/null || exit 77
exec unshare -m bash -c "mount -t tmpfs -o size=${size}m none /dev/shm && exec \"\$@\"" small_shm "$@"
