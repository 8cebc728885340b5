# How the tests are built, and that they can fail.

strict="-O0 -g -std=f2008 -pedantic -Wall -Wextra -Werror -fcheck=all,no-array-temps -ffpe-trap=invalid,zero,overflow -finit-real=snan -finit-derived"
optimised="-O3 -Wall -Wextra -Werror"
# Code for the machine at hand: fused operations, long vectors.
native="-O3 -march=native -fno-math-errno -fno-trapping-math"
recommended="$native -fno-tree-slp-vectorize -mprefer-vector-width=512"
sanitized="-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer"

# tests_built FLAGS: where the compiler takes these flags.
tests_built() {
    echo end | gfortran $1 -x f95 -c -o /dev/null - || skipped "the compiler refuses $1"
    "$fpm" test --flag "$1"
}

# tests_by COMPILER FLAGS: by another release of the compiler.
tests_by() {
    apt_package "$1" "$1"
    "$fpm" test --compiler "$1" --flag "$2"
}

# The README's command. A check that fails, a stop in the library and an unknown name fail it.
tests_can_fail() {
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
    "$fpm" test --flag "-O0 --coverage"
    python3 .ci/gates/coverage.py 97
}
