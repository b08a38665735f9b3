#!/usr/bin/env bash
# Compares two files of digests that run.sh wrote on one machine. See README.md.
#
# compare.sh OLD NEW
#
# Exits with 1 if a case that both have differs. A case that was refused and now draws is said, but is no difference.
set -u
export LC_ALL=C

if [ $# != 2 ]; then
    sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
fi
for file in "$1" "$2"; do
    [ -r "$file" ] || { echo "$file: cannot be read" >&2; exit 2; }
done

awk '
    FILENAME == ARGV[1] { picture[$1 " " $2] = $3; counts[$1 " " $2] = $4; next }
    {
        run = $1 " " $2
        seen[run] = 1
        if (!(run in picture)) { print "only new:  " run; only_new++; next }
        both++
        if (picture[run] == "error" && $3 ~ /^[0-9a-f]+$/) { print "now draws: " run; draws++ }
        else if (picture[run] != $3) {
            print "PICTURE:   " run "  " substr(picture[run], 1, 12) " -> " substr($3, 1, 12)
            pictures++
        } else if (counts[run] != $4) {
            print "COUNTS:    " run (counts[run] == "" || $4 == "" ? "  only one of them has counts" : "")
            other++
        } else same++
    }
    END {
        for (run in picture) if (!(run in seen)) { print "only old:  " run | "sort"; only_old++ }
        close("sort")
        printf "%d runs in both: %d the same, %d with another picture, %d with other counts, %d that were refused and now draw; " \
            "only old %d, only new %d\n", both, same, pictures, other, draws, only_old, only_new
        exit pictures + other > 0
    }' "$1" "$2"
status=$?

# Which counts differ, of the runs that both have.
if [ "$status" = 1 ] && [ -r "$1.counts" ] && [ -r "$2.counts" ]; then
    echo "counts that differ (< old, > new; the first 40 lines):"
    in_both() { awk 'FNR == NR { known[$1 " " $2]; next } ($1 " " $2) in known' "$2" "$1.counts"; }
    diff <(in_both "$1" "$2") <(in_both "$2" "$1") | grep '^[<>]' | head -40
fi
exit "$status"
