#!/usr/bin/env bash
# same_contacts.sh PRELOAD PROGRAM [ARGUMENT...]
#
# What a program prints is the same whether or not contacts are found before it asks for them, and some
# are (with CONTACTS_TOLD=none: none are). Ends with status 77 where the program does.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1
shift

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export ODE_PARALLEL_SAP_TEST_GRAIN=1 ODE_PARALLEL_SAP_THREADS=3 ODE_PARALLEL_SAP_STATS=1
for contacts in off auto on; do
  status=0
  ODE_PARALLEL_SAP_CONTACTS=$contacts with_preload "$preload" "$@" >"$folder/$contacts" 2>"$folder/said" || status=$?
  [ $status -eq 0 ] || { cat "$folder/$contacts" "$folder/said"; exit $status; }
done
cat "$folder/said"
[ -s "$folder/off" ] || { echo "the program prints nothing"; exit 1; }
cmp "$folder/off" "$folder/auto"
cmp "$folder/off" "$folder/on"
told=some
grep -q ': [1-9][0-9]* of them were asked for' "$folder/said" || told=none
[ $told = "${CONTACTS_TOLD:-some}" ] || { echo "$told of the contacts were found beforehand"; exit 1; }
