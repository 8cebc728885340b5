# The set-up of ./run.

second_setup_installs_nothing() {
    local command
    mkdir stub
    for command in apt-get sudo; do
        printf '#!/bin/sh\necho "%s was called" >&2\nexit 1\n' "$command" >"stub/$command"
        chmod +x "stub/$command"
    done
    PATH=$PWD/stub:$PATH PIP_NO_INDEX=1 ./run setup >log 2>&1 || { cat log; return 1; }
    cat log
    [ ! -s log ]
}

# fpm does not see that an included file changed; ./run does, once.
changed_include_is_built_anew() {
    ./run fpm --version
    touch build/kept
    ./run fpm --version
    [ -e build/kept ]
    echo '! changed' >>src/flow/turn_formulas.inc
    ./run fpm --version
    [ ! -e build/kept ]
}
