#!/usr/bin/env bash
# The splitting loops allocate nothing: as many allocations in 1000 steps as in 10. FPM names another fpm.
set -e
cd "$(dirname "${BASH_SOURCE[0]}")"
mkdir -p build
gcc -shared -fPIC -o build/count.so count.c
"${FPM:-fpm}" install --prefix "$PWD/build/installed" --profile release
for steps in 10 1000; do
    LD_PRELOAD=$PWD/build/count.so build/installed/bin/allocations "$steps" 2>"build/count.$steps"
    cat "build/count.$steps"
done
grep -q allocations build/count.10
cmp build/count.10 build/count.1000
