#!/bin/bash
# Locks what pyproject.toml names, for `make lock`: requirements/NAME.lock for each group of it, with the
# version and hashes of each package. The lock of `make test` leaves out what that of `make run` has, and
# so on; they are installed together.
#     lock.sh UV PYTHON [--upgrade]
set -eu
cd "$(dirname "$0")/../.."
uv=$1 python=$2 upgrade=${3:-}

# lock NAME OPTIONS...: of what is in each lock named in $before, the same versions, left out.
lock() {
    local name=$1 lock=requirements/$1.lock package options=()
    shift
    for package in $(sed -n 's/^\([a-zA-Z0-9_.-]*\)==.*/\1/p' ${before:+$before} /dev/null); do
        options+=(--no-emit-package "$package")
    done
    for package in $before; do options+=(--constraint "$package"); done
    "$uv" pip compile --quiet $upgrade --generate-hashes --no-header --no-annotate \
        --python "$python" "${options[@]}" "$@" --output-file "$lock"
    sed -i "1i # Made by 'make lock' from pyproject.toml. Do not edit." "$lock"
}

before=""
lock run pyproject.toml --group run
before=requirements/run.lock
lock test pyproject.toml --extra all --group run --group test
before="requirements/run.lock requirements/test.lock"
lock check pyproject.toml --extra all --group run --group test --group check
before=""
for name in docs page installer; do lock "$name" --group "$name"; done
