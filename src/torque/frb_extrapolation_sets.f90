!> Sets of sequences for `extrapolate`, and the lanes of their stages: see frb_extrapolation.
!>
!> | set | sequences | order | stages | lanes | for |
!> |-----|-----------|-------|--------|-------|-----|
!> | 1 | 2..8 | 14 | 9 | 8; 2, 7; 3, 6; 4, 5 | all else |
!> | 2 | 1..6, 8 | 14 | 8 | 8; 2, 6; 3, 5; 1, 4 | the last digits: weights four times smaller |
!> | 3 | 1..6 | 12 | 6 | 6; 1, 5; 2, 4; 3 | loose tolerances |
!>
!> A lane with fewer stages is idle at first, so that most sequences end with the last stage.
module frb_extrapolation_sets
    use frb_extrapolation_lanes, only: lanes
    use frb_kinds, only: wp
    implicit none
    private

    public :: stages, half, kick, time_after, begin, any_ends, last_weights, last_differences, &
        torques_of_step, powers, reaches, set_for

    integer :: j, k
    integer, parameter :: most_stages = 9, sets = 3, stages(sets) = [9, 8, 6]
    !> Number of substeps of the sequence in each lane and stage, and the number of the present substep; 0:
    !> the lane is idle, at the start of the step or (which = 1) at its end.
    integer, parameter :: number(lanes, most_stages, sets) = reshape([ &
        0, 2, 3, 4, 8, 2, 3, 4, 8, 7, 3, 4, 8, 7, 6, 4, 8, 7, 6, 5, &
        8, 7, 6, 5, 8, 7, 6, 5, 8, 7, 6, 5, 8, 7, 6, 5, 8, 2, 3, 0, &
        8, 2, 3, 1, 8, 6, 3, 4, 8, 6, 5, 4, 8, 6, 5, 4, 8, 6, 5, 4, &
        8, 6, 5, 0, 8, 6, 5, 0, 0, 0, 0, 0, 6, 1, 2, 0, 6, 5, 2, 0, &
        6, 5, 4, 0, 6, 5, 4, 3, 6, 5, 4, 3, 6, 5, 4, 3, 0, 0, 0, 0, &
        0, 0, 0, 0, 0, 0, 0, 0], [lanes, most_stages, sets])
    integer, parameter :: which(lanes, most_stages, sets) = reshape([ &
        0, 1, 1, 1, 1, 2, 2, 2, 2, 1, 3, 3, 3, 2, 1, 4, 4, 3, 2, 1, &
        5, 4, 3, 2, 6, 5, 4, 3, 7, 6, 5, 4, 8, 7, 6, 5, 1, 1, 1, 0, &
        2, 2, 2, 1, 3, 1, 3, 1, 4, 2, 1, 2, 5, 3, 2, 3, 6, 4, 3, 4, &
        7, 5, 4, 1, 8, 6, 5, 1, 0, 0, 0, 0, 1, 1, 1, 0, 2, 1, 2, 0, &
        3, 2, 1, 0, 4, 3, 2, 1, 5, 4, 3, 2, 6, 5, 4, 3, 0, 0, 0, 0, &
        0, 0, 0, 0, 0, 0, 0, 0], [lanes, most_stages, sets])
    !> For a step of size one: half of each drift, the kick before it, the time after it, and the last kick of
    !> a sequence.
    real(wp), parameter :: half(lanes, most_stages, sets) = merge(0.5_wp/max(number, 1), 0.0_wp, number > 0)
    real(wp), parameter :: kick(lanes, most_stages, sets) = half*merge(1, 2, which == 1)
    real(wp), parameter :: time_after(lanes, most_stages, sets) = real(which, wp)/max(number, 1)
    !> Lanes that begin a sequence with a stage, and that end one.
    logical, parameter :: begins(lanes, most_stages, sets) = number > 0 .and. which == 1
    logical, parameter :: ends(lanes, most_stages, sets) = number > 0 .and. which == number
    real(wp), parameter :: begin(lanes, most_stages + 1, sets) = reshape( &
        [((merge(1.0_wp, 0.0_wp, begins(:, min(j, most_stages), k) .and. j <= most_stages), &
           j=1, most_stages + 1), k=1, sets)], [lanes, most_stages + 1, sets])
    !> Stages with which a sequence ends.
    logical, parameter :: any_ends(most_stages, sets) = reshape([ &
        .false., .true., .true., .true., .false., .false., .false., .false., .true., &
        .false., .true., .true., .false., .false., .true., .false., .true., .false., &
        .true., .true., .false., .false., .false., .true., .false., .false., .false.], [most_stages, sets])
    !> Weights c_n = prod_(j /= n) n^2/(n^2 - j^2), and c_n minus the weights without the coarsest sequence.
    real(wp), parameter :: weights(8, sets) = reshape( &
        [0.0_wp, 2.0_wp**12/(108864000.0_wp), 3.0_wp**12/(-33264000.0_wp), &
         4.0_wp**12/(23950080.0_wp), 5.0_wp**12/(-31135104.0_wp), 6.0_wp**12/(69189120.0_wp), &
         7.0_wp**12/(-277992000.0_wp), 8.0_wp**12/(2594592000.0_wp), &
         1.0_wp**12/(19051200.0_wp), 2.0_wp**12/(-7257600.0_wp), 3.0_wp**12/(6652800.0_wp), &
         4.0_wp**12/(-10886400.0_wp), 5.0_wp**12/(31135104.0_wp), 6.0_wp**12/(-186278400.0_wp), &
         0.0_wp, 8.0_wp**12/(10897286400.0_wp), &
         1.0_wp**10/(-302400.0_wp), 2.0_wp**10/(120960.0_wp), 3.0_wp**10/(-120960.0_wp), &
         4.0_wp**10/(226800.0_wp), 5.0_wp**10/(-798336.0_wp), 6.0_wp**10/(6652800.0_wp), &
         0.0_wp, 0.0_wp], [8, sets])
    integer, parameter :: squares(8) = [1, 4, 9, 16, 25, 36, 49, 64]
    real(wp), parameter :: differences(8, sets) = reshape( &
        [weights(:, 1)*4/squares, weights(:, 2)/squares, weights(:, 3)/squares], [8, sets])
    !> The weights for each lane and stage with which a sequence ends, else 0.
    real(wp), parameter :: last_weights(lanes, most_stages, sets) = reshape( &
        [((merge(weights(max(number(:, j, k), 1), k), 0.0_wp, ends(:, j, k)), j=1, most_stages), &
          k=1, sets)], [lanes, most_stages, sets])
    real(wp), parameter :: last_differences(lanes, most_stages, sets) = reshape( &
        [((merge(differences(max(number(:, j, k), 1), k), 0.0_wp, ends(:, j, k)), j=1, most_stages), &
          k=1, sets)], [lanes, most_stages, sets])

    !> Number of attitudes in a step for which the torque is computed, without the start.
    integer, parameter :: torques_of_step(sets) = [35, 29, 21]
    !> The estimate of the error of a step h goes with this power of h.
    integer, parameter :: powers(sets) = [13, 13, 11]
    !> Radians of a step for which the half angle of its shortest drifts is below 0.5.
    real(wp), parameter :: reaches(sets) = [7.5_wp, 7.5_wp, 5.6_wp]
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
