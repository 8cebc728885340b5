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
