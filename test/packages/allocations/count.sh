#!/usr/bin/env bash
# The splitting loops allocate nothing: as many allocations in 1000 steps as in 10. Takes the library that pkg-config
# finds (./run install says how).
set -e
cd "$(dirname "${BASH_SOURCE[0]}")"
mkdir -p build
gcc -shared -fPIC -o build/count.so count.c
gfortran -O2 -J build $(pkg-config --cflags frb) -o build/allocations app/frb_still_bodies.f90 app/main.f90 \
    $(pkg-config --libs frb) "-Wl,-rpath,$(pkg-config --variable=libdir frb)"
for steps in 10 1000; do
    LD_PRELOAD=$PWD/build/count.so build/allocations "$steps" 2>"build/count.$steps"
    cat "build/count.$steps"
done
grep -q allocations build/count.10
cmp build/count.10 build/count.1000
