!> A step of momentum and attitude of one body, in its principal axes: see one_step.inc.
module frb_flow_state
    use frb_flow_limits, only: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, middle_limit, &
        middle_turn_limit, plain_largest, plain_smallest
    use frb_flow_long, only: long_step
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_unordered
    implicit none
    private

    public :: flow_one

    !> The series that a step uses.
    integer, parameter :: tiny_step = 1, short_step = 2, middle_step = 3, beyond_series = 4
    logical, parameter :: with_attitude = .true.

contains

    include 'one_step.inc'

    include 'orbit_formulas.inc'

    include 'series_formulas.inc'

    include 'short_third_kind.inc'

    include 'tiny_formulas.inc'

    include 'tiny_third_kind.inc'

    include 'short_formulas.inc'

    include 'unit_turn_formulas.inc'

    include 'middle_formulas.inc'

    include 'middle_third_kind.inc'

    include 'turn_formulas.inc'

    include 'join_formulas.inc'

    include 'reach_formulas.inc'

end module frb_flow_state
