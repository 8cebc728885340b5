# Packages of their own that use this one: test/packages/. Each says in its fpm.toml how it is run by hand.

# package_runs NAME: in debug and in release.
package_runs() {
    cd "test/packages/$1"
    "$fpm" run
    "$fpm" run --profile release
}

loop_allocates_nothing() { FPM=$fpm test/packages/allocations/count.sh; }
