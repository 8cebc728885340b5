# Programs of their own that use this package: test/packages/. Each says in a file how it is run by hand.

# In release; the programs of the README are a package in debug.
dependent_package_runs() {
    cd test/packages/dependent
    "$fpm" run --profile release
}

loop_allocates_nothing() {
    apt_package pkg-config pkg-config
    prepare_clients
    test/packages/allocations/count.sh
}

# Default kinds of twice the size, which a user's flags give to the library as well.
default_kinds_do_not_matter() {
    cd test/packages/kinds
    "$fpm" run --flag "-fdefault-real-8 -fdefault-integer-8"
}
