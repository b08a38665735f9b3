#!/usr/bin/env bash
# Draws every case of cases.txt with a binary and writes the digests of the pictures. See README.md.
#
# run.sh BINARY OUTFILE [JOBS [PATTERN]]     PATTERN: only cases whose name matches this extended regular expression
#
# A line of OUTFILE is NAME THREADS SHA256 [SHA256 of the counts], or NAME THREADS error (or panic, timeout, empty).
# OUTFILE.counts holds the counts themselves, OUTFILE.log what the failing commands said.
# Exits with 1 if a case depends on the number of threads.
set -u
export LC_ALL=C

if [ $# -lt 2 ] || [ $# -gt 4 ]; then
    sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
fi
binary=$(realpath "$1") outfile=$(realpath -m "$2") jobs=${3:-2} pattern=${4:-.}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
data=${RESAMPLE_DATA:-$here/../../../shared/data}
[ -d "$data" ] && data=$(realpath "$data")
[ -x "$binary" ] || { echo "$1: not a program" >&2; exit 2; }

# Pictures of a sequence carry a fingerprint of their command, paths included: two runs must use one folder.
work=${TMPDIR:-/tmp}/resample-digests
mkdir "$work" || { echo "$work: another run is using it, or was killed: remove it" >&2; exit 2; }
trap 'rm -rf "$work"' EXIT
mkdir "$work/in" "$work/runs"
export binary data work here

# The generated inputs: by formula, and then depth pictures that the binary itself draws.
python3 "$here/inputs.py" "$work/in" || exit 2
"$binary" texmap "$work/in/ground.obj" --camera "$work/in/cam_refs.json" --size 128x96 --quiet \
    -o "$work/in/ref_%d.exr" || exit 2
"$binary" texmap "$work/in/ground.obj" --camera "$work/in/cam_refs.json" --size 128x96 --quiet --background black \
    -o "$work/in/ref_%d.png" || exit 2

# Whether the real data that a case names is there; the first file that is not is said.
has_data() {
    local word path
    for word in "$@"; do
        case $word in
            "$data"/*) path=${word%%#*} ;;
            *) continue ;;
        esac
        # FILE.exr:CHANNEL names a channel.
        case $path in *.exr:*) path=${path%:*} ;; esac
        if [ ! -e "$path" ] && ! compgen -G "$path" >/dev/null; then
            echo "${path#"$data"/}"
            return 1
        fi
    done
}

# One run of one case: NAME THREADS WORDS...
one() {
    set -f
    local name=$1 threads=$2 run="$work/runs/$1.$2" words word status missing
    # shellcheck disable=SC2206
    words=($3)
    mkdir "$run" "$run/out"
    words=("${words[@]//\{data\}/$data}")
    words=("${words[@]//\{in\}/$work/in}")
    words=("${words[@]//\{out\}/$run/out}")
    if ! missing=$(has_data "${words[@]}"); then
        [ "$threads" = 1 ] && echo "skipped: $name needs $missing" >&2
        return
    fi
    timeout 300 "$binary" "${words[@]}" --threads "$threads" >"$run/stdout" 2>"$run/stderr" </dev/null
    status=$?
    case $status in
        0) ;;
        101 | 134 | 139) word=panic ;;
        124) word=timeout ;;
        *) word=error ;;
    esac
    if [ "$status" != 0 ]; then
        echo "$name $threads $word" >"$run/line"
        sed "s|^|$name $threads: |; s|$data|{data}|g; s|$run/out|{out}|g; s|$work/in|{in}|g" "$run/stderr" >"$run/log"
        rm -rf "$run/out"
        return
    fi
    case ${words[0]} in
        # These print: what they say, without paths, is the picture.
        # The free memory of the machine is no part of it.
        info | compare)
            sed "/available/d; s|$data|{data}|g; s|$run/out|{out}|g; s|$work/in|{in}|g" "$run/stdout" >"$run/out/stdout"
            ;;
    esac
    local digest counts=
    if [ -f "$run/out/stats.json" ]; then
        python3 "$here/counts.py" "$run/out/stats.json" >"$run/counts" || echo "unreadable" >"$run/counts"
        counts=" $(sha256sum <"$run/counts" | cut -d' ' -f1)"
        sed -i "s|^|$name $threads |" "$run/counts"
        rm "$run/out/stats.json"
    fi
    local files
    files=$(cd "$run/out" && find . -type f -print | sort)
    if [ -z "$files" ]; then
        digest=empty
    elif [ "$(wc -l <<<"$files")" = 1 ]; then
        digest=$(sha256sum <"$run/out/$files" | cut -d' ' -f1)
    else
        digest=$(cd "$run/out" && while read -r file; do sha256sum "$file"; done <<<"$files" | sha256sum | cut -d' ' -f1)
    fi
    echo "$name $threads $digest$counts" >"$run/line"
    # KEEP_PICTURES=FOLDER keeps the pictures of the runs with one thread, to look at.
    if [ -n "${KEEP_PICTURES:-}" ] && [ "$threads" = 1 ]; then
        mkdir -p "$KEEP_PICTURES/$name" && cp -r "$run/out/." "$KEEP_PICTURES/$name/"
    fi
    rm -rf "$run/out" "$run/stdout" "$run/stderr"
}
export -f has_data one

# NAME THREADS and the words, with the short words of cases.txt written out; three NUL-ended fields a run.
awk -v pattern="$pattern" '
    /^[ \t]*(#|$)/ { next }
    # The text of a short word is taken letter by letter: sub() would read marks in it.
    function put(text, short, long,   at) {
        while ((at = index(text, short)) > 0) text = substr(text, 1, at - 1) long substr(text, at + length(short))
        return text
    }
    function full(text,   i) { for (i = count; i >= 1; i--) text = put(text, "{" short[i] "}", long[i]); return text }
    /^[a-z0-9_]+ = / { at = index($0, " = "); long[++count] = full(substr($0, at + 3)); short[count] = $1; next }
    {
        at = index($0, " | ")
        name = $1
        if (at == 0 || name !~ /^\*?[a-zA-Z0-9._-]+$/) { print "cases.txt:" NR ": not a case" > "/dev/stderr"; exit 2 }
        many = sub(/^\*/, "", name)
        if (seen[name]++) { print "cases.txt:" NR ": " name " is there twice" > "/dev/stderr"; exit 2 }
        if (name !~ pattern) next
        words = full(substr($0, at + 3))
        printf "%s\n%d\n%s\n", name, 1, words
        if (many) printf "%s\n%d\n%s\n%s\n%d\n%s\n", name, 2, words, name, 5, words
    }' "$here/cases.txt" >"$work/list" || exit 2
tr '\n' '\0' <"$work/list" | xargs -0 -n 3 -P "$jobs" bash -c 'one "$@"' one

gather() { find "$work/runs" -name "$1" -exec cat {} +; }
gather line | sort -k1,1 -k2,2n >"$outfile"
gather counts | sort >"$outfile.counts"
gather log | sort -s -k1,1 >"$outfile.log"

awk '
    { what = $3 " " $4 }
    $2 == 1 { cases++; if ($3 !~ /^[0-9a-f]+$/) failed++ }
    ($1 in first) && first[$1] != what { print "depends on the number of threads: " $1 " (" $2 ")"; bad = 1; next }
    { first[$1] = what }
    END { print cases + 0 " cases, " NR " runs, " failed + 0 " failing"; exit bad }' "$outfile"
