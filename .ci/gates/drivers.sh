# The drivers, installed in $prefix: end values, constants of the motion, words, what is refused.

prefix=$work/prefix
bin=$prefix/bin

# A driver runs from any folder.
install_elsewhere() {
    ./run fpm install --prefix "$prefix" --profile release
    [ -e "$prefix/lib/libfrb.a" ]
    [ -e "$prefix/include/frb.mod" ]
    mkdir "$work/elsewhere"
    cd "$work/elsewhere"
    "$bin/driver_example2" "$clone/data/init_example2.dat"
    records out_example2.dat 2 8
}

# driver N LINES COLUMNS: with its own init file, the output has this size and the values of the table.
driver() {
    "$bin/driver_example$1" -o "out$1" >"summary$1"
    cat "summary$1"
    records "out$1" "$2" "$3"
    values "out$1"
}

driver_1() {
    driver 1 100001 13
    # The momentum stays bounded; the energy's error stays at rounding level to the end.
    awk '{n = $1*$1 + $2*$2 + $3*$3; if (n < 0.98 || n > 1.02) exit 1}' out1
    awk '/energy, first half/ {a = $NF} /energy, second half/ {b = $NF}
         END {exit !(a > 0 && a < 1e-12 && b > 0 && b < 1e-12)}' summary1
    keeps_its_constants summary1
}

# The summary of a run of the top: the vertical momentum and the norm of the attitude stay at rounding level.
keeps_its_constants() {
    awk '/Q m along u0/ {c = $NF} /off orthogonal/ {d = $NF}
         END {exit !(c > 0 && c < 1e-12 && d > 0 && d < 1e-12)}' "$1"
}

# The same top by another scheme and the paper's steps in the place of the file's scheme and the free flow.
driver_1_by_name() {
    "$bin/driver_example1" --scheme srkn11 --drift quat_step -o out1b >summary1b
    cat summary1b
    grep -q 'scheme srkn11 (11 stages, order 6), drift quat_step$' summary1b
    records out1b 100001 13
    keeps_its_constants summary1b
    "$bin/driver_example1" --drift frb_step:5 -o out1c >summary1c
    cat summary1c
    keeps_its_constants summary1c
    values out1b out1c
    refused 'unknown scheme rk4; known are strang yoshida4 srkn6 s6 srkn11 srkn14 .*aba864' \
        "$bin/driver_example1" --scheme rk4 -o refused.out
    refused 'unknown drift dmv; known are free_flow' "$bin/driver_example1" --drift dmv -o refused.out
    refused '--drift needs the name of a drift' "$bin/driver_example1" -o refused.out --drift
    refused 'more than one --scheme' "$bin/driver_example1" --scheme s6 --scheme s6 -o refused.out
    refused 'unknown option --scheme' "$bin/driver_example3" --scheme s6 -o refused.out
}

driver_words() {
    local n version
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' fpm.toml)
    for n in 0 1 2 3 4; do
        [ "$("$bin/driver_example$n" --version)" = "driver_example$n (frb) $version" ]
        "$bin/driver_example$n" --help | grep -q "^usage: driver_example$n \[INIT\] \[-o OUT\]"
    done
}

driver_refusals() {
    local n
    for n in 0 1 2 3 4; do
        local driver=$bin/driver_example$n
        refused 'no_such_file: cannot be opened' "$driver" no_such_file -o refused.out
        sed '$d' "data/init_example$n.dat" >short.dat
        refused 'short.dat, line [0-9]*: .*expected a number, found the end' "$driver" short.dat -o refused.out
        cp "data/init_example$n.dat" long.dat
        echo 1 >>long.dat
        refused 'long.dat, line [0-9]*: .*expected the end of the file' "$driver" long.dat -o refused.out
        refused 'unknown option --no' "$driver" --no -o refused.out
        refused '-o needs the name' "$driver" -o
        refused 'more than one init file' "$driver" a b
        refused 'more than one -o' "$driver" -o a -o b
        refused 'no_such_folder/out: cannot be opened' "$driver" -o no_such_folder/out
        refused 'cannot be the output too' "$driver" short.dat -o short.dat
        (cd src && refused "data/init_example$n.dat: cannot be opened" "$driver" && rm refused.*)
    done
    sed 's/^1.0 0.0 0.0 /1.0 0.1 0.0 /' data/init_example0.dat >sheared.dat
    refused 'line 12: Q: expected an orthogonal' "$bin/driver_example0" sheared.dat -o refused.out
}
