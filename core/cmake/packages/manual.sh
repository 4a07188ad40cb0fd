#!/bin/sh
# The manual of a program, from what it prints as its help.
#
# usage: manual.sh PROGRAM VERSION SECONDS_SINCE_1970 OUT
set -eu
program=$1 version=$2 out=$4
export SOURCE_DATE_EPOCH="$3" LC_ALL=C.UTF-8 NO_COLOR=1 COLUMNS=80
# Its first line is one sentence; `vantage` begins with its usage, and the sentence is the third line.
summary=$("$program" --help | sed -n '/^usage:/d; /./{s/\.$//; p; q}')
[ -n "$summary" ] || { echo "error: $program --help says nothing" >&2; exit 1; }
mkdir -p "$(dirname "$out")"
help2man --no-info --section 1 --source "Vantage $version" --manual "Vantage" --version-string "$version" \
  --name "$summary" --output "$out" "$program"
gzip -9nf "$out"
