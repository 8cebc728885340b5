# The files of the drivers: what a full disk, links, other runs and other names of a file do to them.

# with_small_disk SIZE FUNCTION: mounts a disk of so many kB at ./disk, seen here only; skips where that is not allowed.
with_small_disk() {
    local as_root=-m
    [ "$(id -u)" = 0 ] || as_root=-rm
    mkdir -p disk
    unshare $as_root mount -t tmpfs -o "size=$1k" none disk 2>/dev/null || { echo "no disk can be mounted"; return "$skip"; }
    export -f "$2" refused
    export bin
    unshare $as_root bash -euc "mount -t tmpfs -o size=$1k none disk; $2"
}

# The disk has 100 kB: runs that write more fail. Then an older output of 4 kB lies there and the rest is filled: to the
# last byte, where every run fails, and all but some pages, where the long ones do. The older output stays.
drivers_meet_a_full_disk() {
    local n free
    for n in 1 3 4; do
        refused 'disk/out: cannot be written (is the disk full?)$' "$bin/driver_example$n" -o disk/out
        [ -z "$(ls -A disk)" ]
    done
    for free in 0 4 60; do
        echo old >disk/old
        dd if=/dev/zero of=disk/filler bs=1k count=$((96 - free)) 2>/dev/null
        for n in 0 1 2 3 4; do
            [ $free = 0 ] || [ $n != 0 -a $n != 2 ] || continue
            refused cannot "$bin/driver_example$n" -o disk/old
            refused cannot "$bin/driver_example$n" -o disk/new
            [ "$(ls -A disk)" = $'filler\nold' ]
            [ "$(cat disk/old)" = old ]
        done
        rm disk/*
    done
    "$bin/driver_example0" -o disk/out
    [ "$(wc -l <disk/out)" = 2 ]
}
full_disk_leaves_no_file() { with_small_disk 100 drivers_meet_a_full_disk; }

# The same by the limit of the shell on the size of files, and by the device that is always full.
full_file_leaves_no_file() {
    local n
    mkdir limited
    for n in 1 3 4; do
        (ulimit -f 20; "$bin/driver_example$n" -o limited/out >limited.stdout 2>limited.stderr) && return 1
        [ "$(wc -l <limited.stderr)" = 1 ]
        [ ! -s limited.stdout ]
        [ -z "$(ls -A limited)" ]
    done
    [ -e /dev/full ] || return 0
    ln -s /dev/full full.out
    for n in 0 1 2 3 4; do
        refused cannot "$bin/driver_example$n" -o full.out
        [ -L full.out ]
        if "$bin/driver_example$n" -o - >/dev/full 2>full.stderr; then return 1; fi
        [ "$(wc -l <full.stderr)" = 1 ]
        # The summary is lost: the run tells.
        if "$bin/driver_example$n" -o "complete$n" >/dev/full 2>full.stderr; then return 1; fi
        [ "$(wc -l <full.stderr)" = 1 ]
        [ -s "complete$n" ]
        if "$bin/driver_example$n" --help >/dev/full 2>/dev/null; then return 1; fi
    done
}

# Whatever name the output has: the input is not overwritten.
input_is_not_overwritten() {
    local n name
    mkdir -p other
    for n in 0 1 2 3 4; do
        cp "data/init_example$n.dat" x
        ln -sf x soft; ln -f x hard; ln -sf ../x other/soft; ln -sf other/soft chain
        for name in x ./x "$PWD/x" other/../x soft ./soft hard other/soft chain /proc/self/cwd/x; do
            refused cannot "$bin/driver_example$n" x -o "$name"
            refused cannot "$bin/driver_example$n" soft -o "$name"
            refused cannot "$bin/driver_example$n" - -o "$name" <x
            refused 'is the input, it cannot be the output too$' "$bin/driver_example$n" /dev/stdin -o "$name" <hard
        done
        # Standard output that is the input, at its end.
        for name in - /dev/stdout; do
            if "$bin/driver_example$n" x -o "$name" 2>/dev/null >>x; then return 1; fi
        done
        cmp x "data/init_example$n.dat"
        [ -L soft ]
        [ -L chain ]
        [ -L other/soft ]
        [ "$(stat -c %h x)" = 2 ]
    done
}

# Two runs with one output: one of them is what there is at the end, whole. Files of other names are nobody's but the
# user's, also in a run that is refused.
runs_do_not_mix() {
    local i first second
    sed 's/^100.0 /1000.0 /' data/init_example3.dat >long
    sed 's/^0.0 2.0 0.01 /0.0 2.0 0.02 /' long >other
    "$bin/driver_example3" long -o long.out
    "$bin/driver_example3" other -o other.out
    if cmp -s long.out other.out; then return 1; fi
    echo notes >both.part
    for i in 1 2 3 4 5; do
        "$bin/driver_example3" long -o both & first=$!
        "$bin/driver_example3" other -o both & second=$!
        wait $first
        wait $second
        cmp -s both long.out || cmp -s both other.out
        [ "$(cat both.part)" = notes ]
        if ls | grep -q '^frb-'; then return 1; fi
    done
    echo old >both
    refused "unknown drift nonsense" "$bin/driver_example1" --drift nonsense -o both
    refused 'unknown scheme nonsense' "$bin/driver_example1" --scheme nonsense no_such_file -o both
    refused cannot "$bin/driver_example1" no_such_file -o both
    refused "more than one -o" "$bin/driver_example1" -o both -o both
    [ "$(cat both both.part)" = $'old\nnotes' ]
}

# A link is followed, to another disk too, and stays; what is read-only is refused.
links_are_followed() {
    local elsewhere run=
    elsewhere=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
    trap "rm -rf '$elsewhere'" EXIT
    "$bin/driver_example4" -o straight
    mkdir folder
    echo old >"$elsewhere/old"
    ln -s "$elsewhere/old" far
    ln -s "$elsewhere/new" new
    ln -s ../far folder/chain
    ln -s loop1 loop2; ln -s loop2 loop1
    "$bin/driver_example4" -o far
    cmp straight "$elsewhere/old"
    "$bin/driver_example4" -o new
    cmp straight "$elsewhere/new"
    echo old >"$elsewhere/old"
    "$bin/driver_example4" -o folder/chain
    cmp straight "$elsewhere/old"
    [ "$(readlink far new folder/chain)" = "$elsewhere/old"$'\n'"$elsewhere/new"$'\n../far' ]
    [ "$(ls "$elsewhere")" = $'new\nold' ]
    refused cannot "$bin/driver_example4" -o loop1
    refused cannot "$bin/driver_example4" -o folder
    # A user for whom rights count.
    if [ "$(id -u)" = 0 ]; then run="setpriv --reuid=65534 --clear-groups"; chmod 777 . folder; fi
    echo old >"it's read only"
    ln -s "it's read only" read-only-link
    chmod 444 "it's read only"
    refused cannot "$bin/driver_example4" -o "it's read only"
    refused cannot "$bin/driver_example4" -o read-only-link
    if $run true 2>/dev/null && $run cat "$bin/driver_example4" >/dev/null 2>&1; then
        refused cannot $run "$bin/driver_example4" -o "it's read only"
        chmod 555 folder
        refused cannot $run "$bin/driver_example4" -o folder/out
    fi
    [ "$(cat "it's read only")" = old ]
}

# Standard input and output, by whatever name, and pipes.
standard_output_loses_nothing() {
    local n name
    for n in 0 1 2 3 4; do
        "$bin/driver_example$n" -o straight >summary
        for name in - /dev/stdout /dev/fd/1; do
            "$bin/driver_example$n" -o $name >redirected 2>summary.stderr
            cmp straight redirected
            [ "$(wc -l <summary.stderr)" = "$(wc -l <summary)" ]
            "$bin/driver_example$n" - -o $name <"data/init_example$n.dat" 2>/dev/null | cmp - straight
        done
        echo first >appended
        "$bin/driver_example$n" -o /dev/stdout >>appended 2>/dev/null
        (echo first; cat straight) | cmp - appended
        "$bin/driver_example$n" - -o piped <"data/init_example$n.dat" >/dev/null
        cmp straight piped
    done
    mkfifo fifo
    cat fifo >from_fifo &
    "$bin/driver_example4" -o fifo >/dev/null
    wait $!
    cmp straight from_fifo
    [ -p fifo ]
    "$bin/driver_example4" -o /dev/null >/dev/null
    [ -c /dev/null ]
}

# The driver reads what a list-directed read takes.
driver_reads_list_directed_input() {
    printf '\357\273\2770.1,   the step\r\n1.0, 1.65, 1.972 kg m2\r\n\r\n.1D0 ,2*-.5e+0/ any\r\n1 3*0.0\r\nnotes 1 2 3\r\n' >list.dat
    printf '0.1 1.0 1.65 1.972 0.1 -0.5 -0.5 1 0 0 0\n' >plain.dat
    "$bin/driver_example2" list.dat -o list.out
    "$bin/driver_example2" plain.dat -o plain.out
    cmp list.out plain.out
    printf '0.1\n1 2 3 4\n1 1 1\n1 3*0\n' >surplus.dat
    refused "surplus.dat, line 2: after I(3): expected the end of the line, found '4'" \
        "$bin/driver_example2" surplus.dat -o refused.out
}
