# The form of the sources.

source_form() {
    if grep -rnE '.{111,}' src app test examples --include='*.f90' --include='*.inc'; then return 1; fi
    if grep -rnP '\t| +$' src app test examples --include='*.f90' --include='*.inc'; then return 1; fi
    local file module
    # Every module is named after the package; in src/ each stands in the file of its name.
    for file in $(grep -rlE '^module ' src app test --include='*.f90'); do
        for module in $(sed -n 's/^module \([a-z0-9_]*\).*/\1/p' "$file"); do
            case $module in frb|frb_*) ;; *) echo "$file holds $module"; return 1 ;; esac
            case $file in
                "src/$module.f90"|src/*/"$module.f90"|app/*|test/*) ;;
                *) echo "$file holds $module"; return 1 ;;
            esac
        done
    done
}

# By the release of the linter whose rules the sources were written to.
lint() {
    local linter=fortitude
    if [ "$(fortitude --version 2>/dev/null)" != 'fortitude 0.10.0' ]; then
        linter=$work/linter/bin/fortitude
        { python3 -m venv "$work/linter" && "$work/linter/bin/python" -m pip install -q fortitude-lint==0.10.0; } ||
            skipped 'no fortitude 0.10.0, and pip cannot install it'
    fi
    "$linter" check src app test examples
}

# The version of fpm.toml is that of the library, of C headers that tell one, of a citation file, and the first in the
# change log of the README. What the drivers answer to --version is a gate of its own.
versions_agree() {
    local version file
    version=$(sed -n 's/^version = "\(.*\)"$/\1/p' fpm.toml)
    [ -n "$version" ]
    grep -q "version = '$version'\$" src/base/frb_release.f90
    for file in $(grep -rl --include='*.h' 'define FRB_VERSION ' src include 2>/dev/null); do
        grep -q "define FRB_VERSION \"$version\"" "$file" || { echo "$file: not $version"; return 1; }
    done
    for file in $(grep -rlE --include=CMakeLists.txt '^ *find_package\(frb ' .); do
        grep -q "find_package(frb ${version%.*} " "$file" || { echo "$file: not ${version%.*}"; return 1; }
    done
    [ ! -e CITATION.cff ] || grep -q "^version: \"\?$version\"\?\$" CITATION.cff
    if grep -qi '^#.*change log' README.md; then
        [ "$(sed -n '/^#.*[Cc]hange log/,$p' README.md | grep -oE '[0-9]+\.[0-9]+\.[0-9]+' | head -n 1)" = "$version" ]
    fi
}

# In suites scores are collected by worst_of and largest of frb_checks: max and maxval may pass NaN over. Units and
# status codes are no scores.
no_suite_is_blind_to_nan() {
    if grep -nP '(\b\w+(\([^()]*\))?) = max\(\1,|at_most\(.*\bmaxval\(' test/frb_test_*.f90 |
        grep -vE ' (unit|code) = max'; then return 1; fi
}
