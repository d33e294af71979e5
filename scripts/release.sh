#!/usr/bin/env bash
# Build and check a release in dist/ from the last commit, then use it as a stranger would: release.sh PYTHON
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-python3}
work=$PWD/build/release
rm -rf "$work" build/matrix dist
mkdir -p "$work/source"

[ -z "$(git status --porcelain)" ] || echo "note: the last commit is released, without what is changed here"
git archive HEAD | tar x -C "$work/source"
# An index shows README alone: links of the repository lead nowhere there.
"$python" scripts/site.py README.md >"$work/source/README.md"
"$python" -m build --outdir dist "$work/source" >"$work/build.log" 2>&1 || { tail -n 20 "$work/build.log" && exit 1; }
"$python" -m twine check --strict dist/*
check=$(dirname "$("$python" -c 'import sys; print(sys.executable)')")
"$check/check-wheel-contents" dist/*.whl
# The authors have no common address.
"$check/pyroma" --min=10 --skip-tests AuthorEmail dist/*.tar.gz
ls -l dist
scripts/matrix.sh dist/*.whl "$python"
(cd build/matrix/3.*/ && venv/bin/artperl demo)

version=$("$python" -c 'import sys, tomllib; print(tomllib.load(open("pyproject.toml", "rb"))["project"]["version"])')
echo "CHANGELOG.md has version $version? Then: git tag v$version; git push origin v$version; twine upload dist/*"
