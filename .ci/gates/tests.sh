# How the tests are built, and that they can fail.

strict="-O0 -g -std=f2008 -pedantic -Wall -Wextra -Werror -fcheck=all,no-array-temps -ffpe-trap=invalid,zero,overflow -finit-real=snan -finit-derived"
# Without alarms about uninitialised values: most are about arrays and strings that gfortran makes itself. The strict
# build sets what is uninitialised to NaN.
optimised="-O3 -Wall -Wextra -Werror -Wno-uninitialized -Wno-maybe-uninitialized"
# Code for the machine at hand: fused operations, long vectors.
native="-O3 -march=native -fno-math-errno -fno-trapping-math"
# What of undefined behaviour the run-time checks do not look for; the others of -fsanitize=undefined are about pointers
# and bounds, which -fcheck=all looks for, and take a quarter of the time of compilation.
sanitized="-fsanitize=address,signed-integer-overflow,shift,integer-divide-by-zero,bool,float-cast-overflow \
    -fno-sanitize-recover=undefined -fno-omit-frame-pointer"

# For runs whose long tests need not be long.
brief=--brief
[ "${FRB_CI_FULL:-}" != 1 ] || brief=

# Without the drivers, charts and examples, which fpm builds with the tests. Files that the tests include stay.
library_and_tests_alone() {
    find app examples -name '*.f90' -delete
    sed -i '/^\[\[example\]\]/,/^$/d' fpm.toml
}

# All that is compiled, and with sanitizers what is run here; long tests in brief, but before a version is named.
tests_strict() {
    "$fpm" build --no-prune --flag "$strict"
    library_and_tests_alone
    "$fpm" test --no-prune --flag "$strict $sanitized" -- $brief
}

# The library built by the flags for speed goes into a shared object, too.
tests_native() {
    library_and_tests_alone
    ./run --native test
    ./run --native fpm install --prefix "$PWD/build/installed"
    test/packages/shared/link.sh "$PWD/build/installed"
}

# tests_built FLAGS: where the compiler takes these flags.
tests_built() {
    library_and_tests_alone
    echo end >probe.f90
    gfortran $1 -c -o /dev/null probe.f90 || skipped "the compiler refuses $1"
    "$fpm" test --flag "$1"
}

# tests_by COMPILER FLAGS: by another release of the compiler; long tests in brief, but before a version is named.
tests_by() {
    apt_package "$1" "$1"
    library_and_tests_alone
    "$fpm" test --compiler "$1" --flag "$2" -- $brief
}

# The README's command. A check that fails, a stop in the library and an unknown name fail it.
tests_can_fail() {
    library_and_tests_alone
    ./run test
    if ./run test -- --fail >log 2>&1; then return 1; fi
    grep -Eq '^[0-9]+ passed, 1 failed$' log
    # A stop leaves no closing line, and another name than those known runs nothing.
    if ./run test -- --stop >log 2>&1; then return 1; fi
    if grep -Eq '^[0-9]+ passed' log; then return 1; fi
    if ./run test -- base no-such-suite >log 2>&1; then return 1; fi
    grep -q 'no such suite: no-such-suite' log
    if grep -Eq '^suite ' log; then return 1; fi
}

# Lines of src/ that the tests run, in percent of all.
tests_run_every_line() {
    library_and_tests_alone
    "$fpm" test --flag "-O0 --coverage"
    python3 .ci/gates/coverage.py 97
}
