#!/usr/bin/env bash
# Install the system libraries that PyBullet's EGL renderer needs, or say how.
set -euo pipefail

packages=(libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri)

if ! command -v dpkg-query >/dev/null; then
    echo "not Debian or Ubuntu: make sure that Mesa's EGL is installed (on Debian: ${packages[*]})" >&2
    exit 0
fi
missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    exit 0
fi
if [ "$(id -u)" -ne 0 ]; then
    echo "PyBullet's EGL renderer needs system libraries; run: sudo apt-get install ${missing[*]}" >&2
    exit 0
fi
apt-get update -qq
DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}"
