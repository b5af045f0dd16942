#!/bin/bash
# hide_names.sh NAMES LIBRARY OBJECT...: makes a library of the objects in which every global name
# that matches none of NAMES (regular expressions, spaces between) has the prefix "runtime." A program
# cannot have such a name, so it cannot clash with one. AVR_NM, AVR_OBJCOPY, AVR_AR: the tools.
set -eu -o pipefail
names=$1 library=$2
shift 2
folder=$library.objects
mkdir -p "$folder"
rm -f "$folder"/*
"${AVR_NM:-avr-nm}" --defined-only --extern-only "$@" |
    awk -v names="$names" '
        BEGIN { gsub(/[ \t]+/, "|", names); names = "^(" names ")$" }
        NF == 3 && $3 !~ names { print $3, "runtime." $3 }' |
    sort -u > "$folder/hidden.txt"
for object in "$@"; do
    "${AVR_OBJCOPY:-avr-objcopy}" --redefine-syms="$folder/hidden.txt" "$object" \
        "$folder/$(basename "$object")"
done
"${AVR_AR:-avr-gcc-ar}" rcs "$library" "$folder"/*.o
