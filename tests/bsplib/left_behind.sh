#!/bin/bash
# left_behind.sh <command...>: in a /dev/shm of its own, with what killed programs left there. 77 if that cannot be had.
unshare -m mount -t tmpfs none /dev/shm 2>/dev/null || exit 77
# shellcheck disable=SC2016  # the inner shell expands it
exec unshare -m bash -c '
mount -t tmpfs -o size=64m none /dev/shm || exit 77
old=/dev/shm/bsp2-shared-1-0123456789abcdef fresh=/dev/shm/bsp2-shared-2-0123456789abcdef other=/dev/shm/bsp2-other
held=/dev/shm/bsp2-shared-3-0123456789abcdef # of a program that still makes it, and was stopped for long
head -c 20M /dev/zero > $old; touch $fresh $other $held; touch -d "2 minutes ago" $old $other $held; mkdir -p /dev/shm/bsp2-shared-d
touch -d "2 minutes ago" /dev/shm/bsp2-shared-d
exec 9<$held && flock --shared 9 || exit 1
"$@" || exit 1
[ ! -e $old ] || { echo "$old is still there"; exit 1; }
[ -e $fresh -a -e $other -a -e $held -a -d /dev/shm/bsp2-shared-d ] || { echo "more was removed than was left behind"; exit 1; }
[ $(ls /dev/shm | wc -l) = 4 ] || { ls /dev/shm; echo "this program left something"; exit 1; }' left_behind "$@"
