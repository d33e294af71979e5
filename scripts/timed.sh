#!/usr/bin/env bash
# Run a command, and say how long it took: timed.sh NAME COMMAND... The file $MINUTES, where set, gets a line of it too.
set -uo pipefail

"${@:2}"
code=$?
line="$1: $((SECONDS / 60)) min $((SECONDS % 60)) s"
echo "$line"
[ -z "${MINUTES:-}" ] || echo "$line" >>"$MINUTES"
exit $code
