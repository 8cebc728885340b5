# Scenes that take longer than an example, or more than one process.

# 20 ps of 64 water molecules: the total energy at the start to 1e-8; its rms about a line 0.0139 kcal/mol within
# 15 % with velocity Verlet at 1 fs, below 3e-5 with srkn6 at 4 fs; with NO_SQUISH for the drift 100 times that.
water_keeps_its_energy() {
    "$fpm" run --example scene7_water --profile release -- 20 >water 2>log || { cat log; return 1; }
    cat water
    awk '
        $1 == "total" {start = $3 + 511.634916089; if (start < 0) start = -start; good += start <= 1e-8}
        $1 == "verlet" {good += $4 >= 0.85*0.0139 && $4 <= 1.15*0.0139}
        $1 == "srkn6" {good += ($4 > 0 && $4 < 3e-5) + ($5 > 1e-3)}
        END {exit good != 4}' water
}

# Over 1, 2 and 3 ranks: the same to all printed digits; a NaN on one ends all with the same status.
mpi_ranks_agree() {
    local run ranks statuses
    apt_package mpifort libopenmpi-dev
    apt_package mpirun openmpi-bin
    # As root, and with more ranks than cores.
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    run='timeout 300 mpirun --oversubscribe --mca mpi_yield_when_idle 1'
    cd examples/mpi
    # Little optimised, which compiles in half the time.
    local built=(--flag -O1)
    [ "${FRB_CI_FULL:-}" != 1 ] || built=(--profile release)
    "$fpm" install --prefix installed --compiler mpifort "${built[@]}"
    for ranks in 1 2 3; do
        statuses=$(printf ' %s' $(yes 0 | head -n $ranks))
        $run -n $ranks installed/bin/dipoles >output
        cat output
        prints_its_comment app/dipoles.f90 <(sed "s/^status on the ranks:$statuses\$/status on the ranks: 0 0/" output)
        statuses=$(printf ' %s' $(yes 8 | head -n $ranks))
        $run -n $ranks installed/bin/dipoles fail >output
        cat output
        grep -qx "status on the ranks:$statuses" output
        [ "$(wc -l <output)" = 5 ]
        # Of the last whole step before the NaN, whose energy is as good.
        grep -q '^ *7.1 .* -1.815160953$' output
    done
    for ranks in 1 3; do
        $run -n $ranks installed/bin/free_bodies >output
        cat output
        prints_its_comment app/free_bodies.f90 output
    done
}
