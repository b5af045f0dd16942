#!/bin/bash
# Installs the Debian packages of lists that are not here yet, for `make`.
#     debian.sh LIST...       a package a line, the text after # says what for
set -eu
missing=()
for package in $(sed 's/#.*//' "$@"); do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0
echo "set-up: Debian packages: ${missing[*]}"
sudo=
if [ "$(id -u)" != 0 ]; then
    sudo=sudo
    command -v sudo >/dev/null || {
        echo "Not root and no sudo here. As root: apt-get install ${missing[*]}" >&2
        exit 1
    }
fi
mkdir -p build
{
    $sudo apt-get update -q
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
        -o APT::Keep-Downloaded-Packages=false "${missing[@]}"
} >build/apt.log 2>&1 || {
    tail -n 20 build/apt.log >&2
    echo "The whole log: build/apt.log" >&2
    exit 1
}
