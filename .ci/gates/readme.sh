# The README and the examples say what happens.

# The commands of the README: every line of its blocks marked sh.
readme_commands() { sed -n '/^```sh$/,/^```$/{/^```/!p}' README.md; }

# Each as a user pastes it, in their order; the run of the tests is counted elsewhere.
readme_commands_run() {
    local command
    readme_commands | grep -qx './run test'
    readme_commands | grep -qx './run example1'
    while IFS= read -r command; do
        case $command in
            *'run test' | '') ;;
            *)
                printf '%s\n' "$command"
                bash -c "$command" </dev/null
                ;;
        esac
    done < <(readme_commands)
}

# The program of the README, its block marked fortran, prints the text block after it.
readme_program_says_what_is_printed_below_it() {
    mkdir -p build/readme/app
    printf 'name = "readme"\n[dependencies]\nfrb.path = "../.."\n' >build/readme/fpm.toml
    sed -n '/^```fortran$/,/^```$/{/^```/!p}' README.md >build/readme/app/main.f90
    awk '/^```fortran$/ {seen = 1} seen && /^```text$/ {inside = 1; next} inside && /^```$/ {exit} inside' \
        README.md >build/readme/expected
    [ -s build/readme/expected ]
    cd build/readme
    "$fpm" build
    "$fpm" run 2>log | grep -v '^Project is up to date' >output
    cat log
    diff expected output
}

# prints_its_comment SOURCE OUTPUT: the output is the closing comment of the source, blanks at the start of lines aside.
prints_its_comment() {
    sed -n '/^! Output:$/,$p' "$1" | sed '1d; s/^! *//' >expected
    [ -s expected ] || return 1
    sed 's/^ *//' "$2" | diff expected -
}

# Each example prints what its closing comment says, blanks at the start of a line aside.
examples_print_their_comments() {
    local source example
    "$fpm" build
    for source in examples/*.f90; do
        example=$(basename "$source" .f90)
        printf '%s\n' "$example"
        "$fpm" run --example "$example" 2>log | grep -v '^Project is up to date' >output
        prints_its_comment "$source" output || { cat log; return 1; }
    done
}
