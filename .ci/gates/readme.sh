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

# Each program of the README, a block marked fortran, prints the text block after it. All are in one package.
readme_programs_say_what_is_printed_below_them() {
    local number count
    count=$(grep -cx '```fortran' README.md)
    mkdir -p build/readme/app
    printf 'name = "readme"\n[dependencies]\nfrb.path = "../.."\n' >build/readme/fpm.toml
    for number in $(seq "$count"); do
        printf '[[executable]]\nname = "program%d"\nmain = "program%d.f90"\n' $number $number >>build/readme/fpm.toml
        readme_block fortran "$number" >"build/readme/app/program$number.f90"
    done
    cd build/readme
    "$fpm" build
    for number in $(seq "$count"); do
        (cd ../..; readme_block text "$number") >expected
        [ -s expected ]
        "$fpm" run "program$number" >output
        diff expected output
    done
}

# readme_block KIND NUMBER: the lines of one block of the README.
readme_block() {
    awk -v fence="\`\`\`$1" -v number="$2" '
        inside && /^```$/ {inside = 0}
        inside && count == number
        $0 == fence {count++; inside = 1}' README.md
}

# A newcomer reads 1500 words.
readme_is_short() {
    [ "$(wc -w <README.md)" -le 1500 ]
    [ "$(wc -l <README.md)" -le 150 ]
}

# Every link of every README of the tree, pictures among them, leads to a file.
links_lead_somewhere() {
    local page target missing=0
    for page in $(find . -name build -prune -o -name '.venv*' -prune -o -name README.md -print); do
        for target in $(grep -oE '\]\([^)]+\)' "$page" | sed 's/^](//; s/)$//; s/#.*//'); do
            case $target in http* | '') continue ;; esac
            [ -e "$(dirname "$page")/$target" ] || { printf '%s: %s\n' "$page" "$target"; missing=1; }
        done
    done
    return $missing
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
    "$fpm" build --profile release
    for source in examples/*.f90; do
        example=$(basename "$source" .f90)
        printf '%s\n' "$example"
        "$fpm" run --profile release --example "$example" 2>log | grep -v '^Project is up to date' >output
        prints_its_comment "$source" output || { cat log; return 1; }
    done
}
