# The library in other languages and builds: what ./run install gives, the CMake build, the Python package, another
# compiler. The clients are in test/clients; all print the same bits.

# prepare_clients: an installed library in $here, one for all gates, and the lines of the Fortran client, by pkg-config,
# in $lines.
prepare_clients() {
    here=$work/linking
    lines=$PWD/lines
    (
        flock 9
        [ -e "$here/done" ] || { rm app/charts/frb_charts.f90 && ./run install "$here"; }
        touch "$here/done"
    ) 9>"$work/linking.lock"
    export PKG_CONFIG_PATH=$here/lib/pkgconfig
    compile gfortran client_f test/clients/client.f90
    ./client_f >"$lines"
    [ "$(wc -l <"$lines")" -ge 300 ]
}

# compile COMPILER PROGRAM SOURCE [FLAGS]: by pkg-config.
compile() {
    "$1" $(pkg-config --cflags frb) -o "$2" "$3" ${4:-} $(pkg-config --libs frb) "-Wl,-rpath,$here/lib"
}

# prints_the_same COMMAND...: the lines of the Fortran client.
prints_the_same() { "$@" | cmp - "$lines"; }

installed_library_serves_its_clients() {
    apt_package pkg-config pkg-config
    prepare_clients
    compile gcc client_c test/clients/client.c "-std=c99 -Wall -Wextra -pedantic -Werror"
    prints_the_same ./client_c
    prints_the_same env LD_BIND_NOW=1 ./client_c
    gcc $(pkg-config --cflags frb) -o client_a test/clients/client.c "$here/lib/libfrb.a" \
        $(pkg-config --static --libs-only-l frb | sed 's/-lfrb//')
    prints_the_same ./client_a
    python3 test/clients/client.py "$here/lib/libfrb.so" | cmp - <(head -n 7 "$lines")
    # A user's own short names: `use frb` without `only`.
    compile gfortran short_names test/clients/short_names.f90
    ./short_names
    shared_library_is_tidy
    "$here/bin/driver_example2" -o out2
    records out2 2 8
}

# Its name, no executable stack, no names but its own; module files of the library alone.
shared_library_is_tidy() {
    readelf -d "$here/lib/libfrb.so" | grep -q 'soname: \[libfrb.so.0\]'
    readelf -lW "$here/lib/libfrb.so" | grep GNU_STACK | grep -q ' RW '
    [ "$(nm -D --defined-only "$here/lib/libfrb.so" | grep -c ' frb_')" -ge 14 ]
    if nm -D --defined-only "$here/lib/libfrb.so" | awk '{print $NF}' | grep -Ev '^(__)?frb_'; then return 1; fi
    if ls "$here/include/frb" | grep -E 'chart|driver|dmv'; then return 1; fi
    [ -e "$here/include/frb/frb.mod" ]
}

c_interface_refuses_what_is_wrong() {
    apt_package valgrind valgrind
    apt_package pkg-config pkg-config
    prepare_clients
    compile gcc fuzz test/clients/fuzz.c "-g -Wall -Wextra -pedantic -Werror"
    valgrind --quiet --error-exitcode=9 ./fuzz
}

# A bind(C) name that is also a module's compiles without a word, and calls itself.
no_c_name_is_that_of_a_module() {
    local names modules
    names=$(sed -n "s/.*bind(c, name='\([a-z0-9_]*\)').*/\1/p" src/c/*.f90 | sort -u)
    modules=$(find src app test -name '*.f90' -exec sed -n 's/^module \([a-z0-9_]*\).*/\1/p' {} + | sort -u)
    [ "$(wc -w <<<"$names")" -ge 14 ]
    if comm -12 <(echo "$names") <(echo "$modules") | grep .; then return 1; fi
    # All of them are declared in frb.h.
    local name
    for name in $names; do grep -Eq "\b$name\(" src/c/frb.h; done
}

cmake_builds_and_serves() {
    apt_package cmake cmake
    prepare_clients
    cmake -S test/clients -B clients "-DCMAKE_PREFIX_PATH=$here"
    cmake --build clients
    local language
    for language in c cpp f90; do prints_the_same "clients/client_$language"; done
    # The same from the second build; its flags are those of ./run install.
    cmake -S src -B second "-DCMAKE_INSTALL_PREFIX=$PWD/second_prefix"
    cmake --build second -j 2
    cmake --install second
    cmake -S test/clients -B second_clients "-DCMAKE_PREFIX_PATH=$PWD/second_prefix"
    cmake --build second_clients
    for language in c cpp f90; do prints_the_same "second_clients/client_$language"; done
    cmake -S examples/cpp -B cpp "-DCMAKE_PREFIX_PATH=$here" "-DCMAKE_CXX_FLAGS=-Wall -Wextra -pedantic -Werror"
    cmake --build cpp
    cpp/fix_rigid
    [ "${FRB_CI_FULL:-}" = 1 ] || return 0
    cmake -S test/clients -B static "-DCMAKE_PREFIX_PATH=$here" -DFRB_STATIC=ON
    cmake --build static
    for language in c cpp f90; do prints_the_same "static/client_$language"; done
    cmake -S examples/cpp -B within "-DFRB_SOURCE=$PWD/src"
    cmake --build within -j 2
    within/fix_rigid
}

# The package in an environment of its own; the lines of the Fortran client come from the same flags.
python_package_agrees() {
    apt_package cmake cmake
    prepare_clients
    python3 -m venv python
    python/bin/pip install --quiet --disable-pip-version-check ./src/python
    prints_the_same python/bin/python test/clients/package.py
    python/bin/python -c 'import doctest, frb_rigid_body; assert doctest.testmod(frb_rigid_body) == (0, 7)'
    [ "${FRB_CI_FULL:-}" = 1 ] || return 0
    python/bin/pip install --quiet --disable-pip-version-check matplotlib
    python/bin/python examples/python/racket.py racket.svg | grep '^period 149.0763448967'
    python3 -c 'import xml.dom.minidom as m; m.parse("racket.svg")'
}

# Built without a warning, tests passed; what needs 30 digits is told as skipped.
tests_by_flang() {
    command -v flang-new-22 >/dev/null || [ "${FRB_CI_FULL:-}" = 1 ] || skipped "no flang-22"
    apt_package flang-new-22 flang-22
    library_and_tests_alone
    local flags="-O0"
    if [ "${FRB_CI_FULL:-}" = 1 ]; then flags=-O2; fi
    local code=0
    "$fpm" test --compiler flang-new-22 --flag "$flags" -- $brief >log 2>&1 || code=$?
    cat log
    [ $code = 0 ]
    if grep -i 'warning:' log; then return 1; fi
    grep -E '^[0-9]+ skipped$' log
}

# FORD has no complaint about what a user sees, and its front page has every public name. (It knows nothing of the text
# of `module procedure` lines, nor of local variables.)
pages_of_public_names() {
    local name names
    names=$(sed -n '/^module frb$/,/implicit none/p' src/frb.f90 | sed 's/&$//' | tr '\n' ' ' |
        sed 's/use [a-z_]*, only:/,/g; s/=> [a-z_]*//g; s/.*module frb//; s/implicit none.*//' | tr -s ', ' '\n')
    [ "$(wc -w <<<"$names")" -ge 60 ]
    for name in $names; do
        grep -Eq "(\[\[|\`)$name(\]\]|\`)" src/frb.md || { echo "src/frb.md lacks $name"; return 1; }
    done
    ./run docs -w >pages 2>&1 || { tail -n 20 pages; return 1; }
    [ -e build/docs/index.html ]
    grep -q 'proc/frb_step.html' build/docs/index.html
    tr '\n' ' ' <pages | sed 's/Warning: /\n&/g' >warnings
    if grep -E 'Could not substitute|metadata' warnings; then return 1; fi
    local public
    public=$(for name in $names; do
        grep -lE "^ *(module|.*subroutine|.*function|interface|type.*::) $name\b" src/*/*.f90 || true
    done | sort -u | sed 's|.*/||' | tr '\n' '|')
    if grep -E "Undocumented (bound|interface|type|proc|function|subroutine|module )" warnings |
        grep -E "'(${public%|})'"; then return 1; fi
}
