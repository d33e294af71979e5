#!/usr/bin/env bash
# Install the Vulkan driver that SAPIEN needs to render on a CPU, or say how: Mesa's lavapipe, from 24.3 on. Where the
# distribution's own Mesa is older, a newer one comes from its backports, found through this machine's apt sources.
set -euo pipefail

needed=24.3
libraries=(libvulkan1 libx11-6 libxcb1 libgl1 libglib2.0-0) # what the wheels of sapien and its opencv-python load

version() { dpkg-query -W -f='${Status} ${Version}\n' "$1" 2>/dev/null | sed -n 's/^install ok installed //p'; }
is_new() { [ -n "$1" ] && dpkg --compare-versions "$1" ge "$needed"; }
candidate() { apt-cache policy mesa-vulkan-drivers | sed -n 's/^ *Candidate: //p'; }
backported() { apt-cache madison mesa-vulkan-drivers | awk -F' *[|] *' -v s="$1/" 'index($3, s) {print $2; exit}'; }

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    echo "not Debian or Ubuntu: for SAPIEN, install a Vulkan driver (a GPU's own, or Mesa's lavapipe >= $needed)" >&2
    exit 0
fi
missing=()
for package in "${libraries[@]}"; do
    # Since 2024 some names end with t64.
    [ -n "$(version "$package")" ] || [ -n "$(version "${package}t64")" ] || missing+=("$package")
done
if is_new "$(version mesa-vulkan-drivers)" && [ ${#missing[@]} -eq 0 ]; then
    exit 0
fi
if [ "$(id -u)" -ne 0 ]; then
    echo "SAPIEN needs a Vulkan driver (mesa-vulkan-drivers >= $needed) and system libraries; run: sudo $0" >&2
    exit 0
fi

export DEBIAN_FRONTEND=noninteractive
install=(apt-get install -qq -y --no-install-recommends)
apt-get update -qq || true # a source of someone else's may be out of order
if ! is_new "$(candidate)"; then
    # shellcheck disable=SC1091
    suite="$(. /etc/os-release && echo "$VERSION_CODENAME")"
    backports="$suite-backports"
    if [ -z "$(backported "$backports")" ]; then
        # The archive that serves this release's main component serves its backports too, signed with the same key.
        read -r uri source < <(apt-get indextargets --format '$(RELEASE) $(COMPONENT) $(REPO_URI) $(SOURCESENTRY)' \
            'Created-By: Packages' | awk -v s="$suite" '$1 == s && $2 == "main" {print $3, $4; exit}') || true
        if [ -z "${uri:-}" ]; then
            echo "no apt source of $suite main found: add $backports to the apt sources, then run $0 again" >&2
            exit 0
        fi
        entry=/etc/apt/sources.list.d/artsim-backports.sources
        printf 'Types: deb\nURIs: %s\nSuites: %s\nComponents: main\n' "$uri" "$backports" >"$entry"
        key="$(sed -nE 's/.*[Ss]igned-[Bb]y[:=] *(\/[^] ]+).*/\1/p' "${source%:*}" | head -n 1)"
        [ -z "$key" ] || echo "Signed-By: $key" >>"$entry"
        apt-get update -qq || true
    fi
    if ! is_new "$(backported "$backports")"; then
        rm -f /etc/apt/sources.list.d/artsim-backports.sources
        echo "$backports has no mesa-vulkan-drivers >= $needed: install a newer Mesa by hand, or use a GPU's driver" >&2
        exit 0
    fi
    install+=(-t "$backports")
fi
if ! said="$("${install[@]}" mesa-vulkan-drivers "${missing[@]}" 2>&1)"; then
    echo "$said" >&2
    echo "SAPIEN's Vulkan driver is not installed; mend what apt says, then run: $0" >&2
fi
