!> A step of the momentum alone of one body, in its principal axes: see one_step.inc.
module frb_flow_momentum
    use frb_flow_limits, only: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, middle_limit, &
        middle_turn_limit, plain_largest, plain_smallest, tiny_step, short_step, middle_step, beyond_series
    use frb_flow_long, only: long_step
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_unordered
    implicit none
    private

    public :: flow_one

    logical, parameter :: with_attitude = .false.

contains

    include 'one_step.inc'

end module frb_flow_momentum
