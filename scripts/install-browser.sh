#!/usr/bin/env bash
# Install Chromium, in which the tests open the pages that artsim writes, or say how.
set -euo pipefail

for name in chromium chromium-browser google-chrome; do
    if command -v "$name" >/dev/null; then exit 0; fi
done
if ! command -v apt-get >/dev/null; then
    echo "not Debian or Ubuntu: install Chromium, or Chrome, for the tests of pages" >&2
    exit 0
fi
if [ "$(id -u)" -ne 0 ]; then
    echo "the tests of pages need a browser; run: sudo $0" >&2
    exit 0
fi
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq || true # a source of someone else's may be out of order
if ! said="$(apt-get install -qq -y --no-install-recommends chromium 2>&1)"; then
    echo "$said" >&2
    echo "Chromium is not installed; mend what apt says, then run: $0" >&2
fi
