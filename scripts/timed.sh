#!/usr/bin/env bash
# Run a command, and say how many minutes it took: timed.sh NAME COMMAND... A line of $MINUTES, a file, says so too.
set -uo pipefail

name=$1
start=$(date +%s%N)
"${@:2}"
code=$?
minutes=$((($(date +%s%N) - start) / 6000000))
line=$(printf '%s: %d.%02d minutes' "$name" $((minutes / 10000)) $((minutes % 10000 / 100)))
echo "$line"
[ -z "${MINUTES:-}" ] || echo "$line" >>"$MINUTES"
exit $code
