# What the gates share: the queue that runs them, the count of what passed, and small checks.
#
# Every gate is a shell function of .ci/gates/ (or any command). It runs in a copy of the tree of its own, with set -e,
# without standard input, up to $slots at a time. A gate passes with exit code 0, is skipped with exit code $skip (its
# last line says why), and fails with any other. Results are told in the order of the list, each when it is known, with
# the time it took and the time it kept processors busy.
# With FRB_CI_ONLY=TEXT only gates run that have this text in their names (and what all need).

slots=${FRB_CI_SLOTS:-2}
skip=77

passed=0
failed=0
begun=$SECONDS
all_busy=0
started=0
told=0
names=()
kinds=()

# Copies of the tree, logs and what the gates make.
work=$(mktemp -d) || exit 1
# Each gate is a process group, so that all of it ends with this script.
set -m
trap 'for group in $(jobs -p); do kill -- "-$group"; done 2>/dev/null; wait; rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

# The tree as git sees it, without what it ignores.
git -c safe.directory='*' ls-files -z --cached --others --exclude-standard |
    while IFS= read -r -d '' file; do [ ! -e "$file" ] || printf '%s\0' "$file"; done |
    tar --null -T - -cf "$work/tree.tar" || exit 1

# copy_of_tree FOLDER: makes it, with the set-up of the first copy and what was built there once there is any.
copy_of_tree() {
    mkdir -p "$1" && tar -xf "$work/tree.tar" -C "$1"
    [ "$1" = "$clone" ] || [ ! -e "$clone/.venv" ] || ln -s "$clone/.venv" "$1/.venv"
    [ "$1" = "$clone" ] || [ ! -e "$clone/build" ] || cp -a "$clone/build" "$1/build"
}
clone=$work/frb
copy_of_tree "$clone" || exit 1

# gate NAME COMMAND...: counted as one.
gate() { start gate "$@"; }
# tests NAME COMMAND...: a run of the test program; its checks are counted too.
tests() { start tests "$@"; }
# first NAME COMMAND...: a gate in $clone that the later ones need; nothing runs beside it.
first() {
    all_done
    start first "$@"
    all_done
}

start() {
    local kind=$1 name=$2 folder
    shift 2
    case $name in *"${FRB_CI_ONLY:-}"*) ;; *) [ "$kind" = first ] || return 0 ;; esac
    while [ "$(jobs -rp | wc -l)" -ge "$slots" ]; do wait -n; done
    tell
    folder=$work/$started
    names[started]=$name
    kinds[started]=$kind
    started=$((started + 1))
    mkdir "$folder"
    run_gate "$folder" "$kind" "$@" &
}

run_gate() {
    local folder=$1 tree=$1/frb from=$SECONDS code
    case $2 in
        first) tree=$clone ;;
        *) copy_of_tree "$tree" ;;
    esac
    shift 2
    # Not inside a condition, where bash forgets set -e.
    (set -e; cd "$tree"; "$@") >"$folder/log" 2>&1 </dev/null
    code=$?
    # The second line of `times` is that of the processes of this gate: XmY.Zs in programs, in the system.
    times >"$folder/times"
    awk -v code=$code -v wall=$((SECONDS - from)) -F '[ms ]+' \
        'NR == 2 {printf "%d %d %.0f\n", code, wall, 60*($1 + $3) + $2 + $4}' "$folder/times" >"$folder/result.part"
    mv "$folder/result.part" "$folder/result"
    # Trees with their builds are large.
    [ "$tree" = "$clone" ] || rm -rf "$tree"
}

all_done() {
    while [ "$(jobs -rp | wc -l)" -gt 0 ]; do wait -n; done
    wait
    tell
}

# Tells the results that are known and whose turn it is.
tell() {
    local folder code seconds busy word
    while [ "$told" -lt "$started" ] && [ -e "$work/$told/result" ]; do
        folder=$work/$told
        read -r code seconds busy <"$folder/result"
        all_busy=$((all_busy + busy))
        case $code in
            0) word=ok passed=$((passed + 1)) ;;
            "$skip") word=skipped ;;
            *) word=FAILED failed=$((failed + 1)) ;;
        esac
        printf '%-7s %-62s %4d s %4d s\n' "$word" "${names[told]}" "$seconds" "$busy"
        case $word in
            FAILED) grep -avE '^\[ *[0-9]+%\]' "$folder/log" | tail -n 25 | sed 's/^/        /' ;;
            skipped) tail -n 1 "$folder/log" | sed 's/^/        /' ;;
        esac
        [ "${kinds[told]}" != tests ] || [ "$word" = skipped ] || count_tests "${names[told]}" "$folder/log"
        told=$((told + 1))
    done
}

# Adds the tests of a run to the totals, from the closing line in a log; too few is a failure of its own. Tests that the
# run counted as skipped (they need what the compiler lacks) are known to be there, but not passed.
count_tests() {
    local name=$1 line left_out
    left_out=$(sed -n 's/^\([0-9]*\) skipped$/\1/p' "$2" | tail -n 1)
    line=$(grep -aE '^[0-9]+ passed, [0-9]+ failed$' "$2" | tail -n 1)
    if [ -z "$line" ]; then
        printf 'FAILED  %s: the tests did not get to their closing line\n' "$name"
        failed=$((failed + 1))
        return
    fi
    set -- $line
    passed=$((passed + $1))
    failed=$((failed + $3))
    if [ $(($1 + $3 + ${left_out:-0})) -lt "$least_tests" ]; then
        printf 'FAILED  %s: %s tests ran, expected at least %s\n' "$name" $(($1 + $3)) "$least_tests"
        failed=$((failed + 1))
    fi
}

# The closing line; true when nothing failed.
finish() {
    all_done
    printf 'wall time %d s, processors busy %d s\n' $((SECONDS - begun)) "$all_busy"
    printf '%d passed, %d failed\n' "$passed" "$failed"
    [ "$failed" = 0 ]
}

# skipped WHY: ends a gate that cannot run here.
skipped() {
    printf '%s\n' "$*"
    exit "$skip"
}

# apt_package COMMAND PACKAGE: the command is there, installed by apt if need be; skips the gate where there is no such
# package.
apt_package() {
    local as_root=()
    if command -v "$1" >/dev/null; then return; fi
    command -v apt-get >/dev/null || skipped "no $1, and no apt-get to install it"
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null || skipped "no $1, and no sudo to install it"
        as_root=(sudo -n)
    fi
    "${as_root[@]}" apt-get -o DPkg::Lock::Timeout=300 update -qq || true
    apt-cache show "$2" >/dev/null 2>&1 || skipped "no $1, and no package $2"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -y -qq \
        --no-install-recommends "$2"
}

# records FILE LINES COLUMNS: the output has so many records, each of so many finite numbers.
records() {
    awk -v lines="$2" -v columns="$3" '
        NF != columns || /[Nn][Aa][Nn]|[Ii]nf/ {bad = 1}
        END {if (bad || NR != lines) {print FILENAME ": " NR " records"; exit 1}}' "$1"
}

# values FILE...: these outputs of drivers have the values of test/driver_values.txt.
values() {
    local file
    for file in "$@"; do
        awk -v file="$file" '
            NR == FNR {
                if ($1 == file) {n++; line[n] = $2; column[n] = $3; value[n] = $4; tolerance[n] = $5}
                next
            }
            {
                for (i = 1; i <= n; i++) if (line[i] == FNR) {
                    d = $column[i] - value[i]
                    if (d < 0) d = -d
                    if (d <= tolerance[i]) good++
                    else print file ", line " FNR ", column " column[i] ": off by " d
                }
            }
            END {if (n == 0 || good != n) {print file ": " good + 0 " of " n + 0 " values"; exit 1}
            }' test/driver_values.txt "$file"
    done
}

# refused PATTERN COMMAND: fails with exit code 1, one line on standard error that has PATTERN, nothing on standard
# output, and no output file.
refused() {
    local pattern=$1 code=0
    shift
    rm -f refused.out
    "$@" >refused.stdout 2>refused.stderr || code=$?
    cat refused.stderr
    [ $code = 1 ] && [ "$(wc -l <refused.stderr)" = 1 ] && grep -q -- "$pattern" refused.stderr &&
        [ ! -s refused.stdout ] && [ ! -e refused.out ] && ! ls | grep -q '^frb-.*part$'
}
