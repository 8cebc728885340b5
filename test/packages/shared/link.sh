#!/usr/bin/env bash
# Links all of an installed library, PREFIX/lib/libfrb.a, into a shared object whose calls are bound when they are made,
# and runs a program that uses it. The linker refuses the whole of a library that is not built for shared objects; parts
# of it link, and may crash. By hand: ./run --native fpm install --prefix PREFIX; test/packages/shared/link.sh PREFIX
set -eu
prefix=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
cd "$made"
gfortran -shared -fPIC -I"$prefix/include" -o libpart.so "$here/frb_part.f90" -Wl,-z,lazy \
    -Wl,--whole-archive "$prefix/lib/libfrb.a" -Wl,--no-whole-archive -llapack -lblas
gfortran -o main "$here/main.f90" -L. -lpart -Wl,-rpath,"$made" -Wl,-z,lazy
env -u LD_BIND_NOW ./main
