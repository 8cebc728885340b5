!> Sets of sequences for `extrapolate`, and the lanes of their stages: see frb_extrapolation.
!>
!> | set | sequences | order | stages | torques | sum of abs(c) | for |
!> |-----|-----------|-------|--------|---------|---------------|-----|
!> | 1 | 4..9, 13 | 14 | 13 | 52 | 120 | all else |
!> | 2 | 3..7, 10, 13 | 14 | 13 | 48 | 23 | the last digits |
!> | 3 | 2..7 | 12 | 7 | 27 | 54 | loose tolerances |
!>
!> A lane has one sequence or two, and is idle at first if they have fewer substeps than the step has stages.
!> Measured on both tops of the charts, these sets need about the least stages in a unit of time of all of
!> their order that four lanes hold in 13 and in 7 stages (without sequence 1, whose drift of a whole step is
!> too long for the series). In the place of 1, the sequences 2..8 (9 stages, 35 torques) need 9 to 16 % more
!> stages and 3 to 8 % more torques; in the place of 2, 1..6, 8 (8 stages, 29 torques) need 25 % more stages.
module frb_extrapolation_sets
    use frb_extrapolation_lanes, only: lanes
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: stages, half, kick, time_after, begin, any_ends, last_weights, last_differences, &
        torques_of_step, powers, reaches, set_for

    integer :: j, k, n
    integer, parameter :: most_stages = 13, sets = 3, stages(sets) = [13, 13, 7]
    !> In each lane: idle stages, substeps of the first sequence, and of the second, 0 if there is none.
    integer, parameter :: before(lanes, sets) = reshape([0, 0, 0, 0, 0, 0, 0, 4, 0, 1, 0, 0], [lanes, sets])
    integer, parameter :: first(lanes, sets) = reshape([13, 4, 5, 6, 13, 3, 6, 4, 7, 6, 2, 3], [lanes, sets])
    integer, parameter :: second(lanes, sets) = reshape([0, 9, 8, 7, 0, 10, 7, 5, 0, 0, 5, 4], [lanes, sets])
    integer, parameter :: first_of(lanes, most_stages, sets) = &
        reshape([((first(:, k), j=1, most_stages), k=1, sets)], [lanes, most_stages, sets])
    integer, parameter :: second_of(lanes, most_stages, sets) = &
        reshape([((second(:, k), j=1, most_stages), k=1, sets)], [lanes, most_stages, sets])
    !> The stage counted from the first of the lane, 1 in its second sequence, the number of the substep in
    !> its sequence, and the number of substeps of the sequence; 0: the lane is idle. (GCC 12 loses the rank
    !> of a constant `merge` within an expression.)
    integer, parameter :: counted(lanes, most_stages, sets) = &
        reshape([((j - before(:, k), j=1, most_stages), k=1, sets)], [lanes, most_stages, sets])
    integer, parameter :: later(lanes, most_stages, sets) = min(max(counted - first_of, 0), 1)
    integer, parameter :: which(lanes, most_stages, sets) = max(counted - first_of*later, 0)
    integer, parameter :: number(lanes, most_stages, sets) = &
        (first_of + (second_of - first_of)*later)*min(which, 1)
    !> For a step of size one: half of each drift, the kick before it, the time after it, and the last kick of
    !> a sequence.
    real(wp), parameter :: half(lanes, most_stages, sets) = merge(0.5_wp/max(number, 1), 0.0_wp, number > 0)
    real(wp), parameter :: kick(lanes, most_stages, sets) = half*merge(1, 2, which == 1)
    real(wp), parameter :: time_after(lanes, most_stages, sets) = real(which, wp)/max(number, 1)
    !> Lanes that begin a sequence with a stage, and that end one.
    logical, parameter :: begins(lanes, most_stages, sets) = which == 1
    logical, parameter :: ends(lanes, most_stages, sets) = number > 0 .and. which == number
    real(wp), parameter :: begin(lanes, most_stages + 1, sets) = reshape( &
        [((merge(1.0_wp, 0.0_wp, begins(:, min(j, most_stages), k) .and. j <= most_stages), &
           j=1, most_stages + 1), k=1, sets)], [lanes, most_stages + 1, sets])
    !> Stages with which a sequence ends.
    logical, parameter :: any_ends(most_stages, sets) = &
        reshape([((any(ends(:, j, k)), j=1, most_stages), k=1, sets)], [most_stages, sets])

    !> All sequences of a set, 0 for none, and their numbers.
    integer, parameter :: sequences(2*lanes, sets) = reshape([(first(:, k), second(:, k), k=1, sets)], &
                                                             [2*lanes, sets])
    integer, parameter :: members(sets) = [(count(sequences(:, k) > 0), k=1, sets)]
    integer, parameter :: coarsest(sets) = [(minval(first(:, k)), k=1, sets)]
    !> Weights c_n = prod_(j /= n) n^2/(n^2 - j^2), with one rounding each.
    real(wp), parameter :: rounded(most_stages, sets) = reshape( &
        [((merge(real(int(n, int64)**(2*members(k) - 2), wp)/real(product( &
              merge(1_int64, int(n*n - sequences(:, k)**2, int64), sequences(:, k) == n &
                    .or. sequences(:, k) == 0)), wp), 0.0_wp, any(sequences(:, k) == n)), &
           n=1, most_stages), k=1, sets)], [most_stages, sets])
    !> Their sum must be 1 to the last digit, or all motion is too slow: the smallest weight takes the rest.
    !> The sum of the leading digits, multiples of 2^-20, is exact.
    real(wp), parameter :: leading(most_stages, sets) = anint(rounded*2**20)/2**20
    real(wp), parameter :: weights(most_stages, sets) = reshape([((rounded(n, k) &
        + merge((1 - sum(leading(:, k))) - sum(rounded(:, k) - leading(:, k)), 0.0_wp, n == coarsest(k)), &
        n=1, most_stages), k=1, sets)], [most_stages, sets])
    !> c_n minus the weights without the coarsest sequence.
    real(wp), parameter :: differences(most_stages, sets) = reshape( &
        [((rounded(n, k)*coarsest(k)**2/n**2, n=1, most_stages), k=1, sets)], [most_stages, sets])
    !> The weights for each lane and stage with which a sequence ends, else 0.
    real(wp), parameter :: last_weights(lanes, most_stages, sets) = reshape( &
        [((merge(weights(max(number(:, j, k), 1), k), 0.0_wp, ends(:, j, k)), j=1, most_stages), &
          k=1, sets)], [lanes, most_stages, sets])
    real(wp), parameter :: last_differences(lanes, most_stages, sets) = reshape( &
        [((merge(differences(max(number(:, j, k), 1), k), 0.0_wp, ends(:, j, k)), j=1, most_stages), &
          k=1, sets)], [lanes, most_stages, sets])

    !> Number of attitudes in a step for which the torque is computed, without the start.
    integer, parameter :: torques_of_step(sets) = [(sum(sequences(:, k)), k=1, sets)]
    !> The estimate of the error of a step h goes with this power of h.
    integer, parameter :: powers(sets) = 2*members - 1
    !> Radians of a step for which the half angle of its shortest drifts is below 0.5.
    real(wp), parameter :: reaches(sets) = 0.94_wp*stages

contains

    !> The set for a tolerance.
    pure function set_for(tolerance) result(set)
        real(wp), intent(in) :: tolerance
        integer :: set
        real(wp), parameter :: fine = 1.0e-13_wp, loose = 1.0e-5_wp

        set = 1
        if (tolerance < fine) set = 2
        if (tolerance >= loose) set = 3
    end function set_for

end module frb_extrapolation_sets
