#!/usr/bin/env bash
# Install a wheel into a fresh environment of each Python, and run the blocks of its README there, away from the
# repository: matrix.sh WHEEL [PYTHON...]. PIP_FIND_LINKS, PIP_EXTRA_INDEX_URL: where CPU builds of torch are.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
wheel=$(realpath "$1")
shift
[ $# -gt 0 ] || set -- python3.10 python3.11 python3.12 python3.13

# Training and the demo, which take minutes, are left to `make release`; `make` is the repository's.
readme='
import re, subprocess, sys
from importlib.metadata import metadata
for kind, block in re.findall(r"^```(\w+)\n(.*?)^```$", metadata("artsim").get_payload(), re.M | re.S):
    if kind == "sh" and "pip install" not in block and not block.startswith("make "):
        lines = [line for line in block.splitlines() if not re.match("artperl (train|demo)", line)]
        subprocess.run(["bash", "-exc", "\n".join(lines)], check=True)
    elif kind == "python":
        subprocess.run([sys.executable, "-c", block], check=True)
'

try() {
    set -e
    rm -rf "$room"
    "$1" -m venv "$room/venv"
    cd "$room"
    export PATH="$room/venv/bin:$PATH"
    pins=$(python -c "import sys; print('-c $here/constraints.txt' * (sys.version_info[:2] == (3, 11)))")
    # shellcheck disable=SC2086 # two words, or none
    pip install --quiet $pins "artsim[view,train,sim] @ file://$wheel"
    echo "environment: $(du -sh venv | cut -f1)"
    python -c "$readme"
}

code=0
for python in "$@"; do
    if ! version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null); then
        echo "$python: not on this machine"
        continue
    fi
    room=$here/build/matrix/$version
    log=$room.log
    mkdir -p "$here/build/matrix"
    SECONDS=0
    echo "Python $version: installing, and running README ..."
    (try "$python") >"$log" 2>&1 & # not a condition, where bash ignores set -e
    if wait $!; then
        echo "Python $version: README works, $(grep '^environment' "$log"), $SECONDS s"
    else
        tail -n 15 "$log"
        echo "Python $version: failed; $log has all of it"
        code=1
    fi
done
exit $code
