!> Long steps of momentum and attitude of one body: see long_step.inc.
module frb_flow_long
    use frb_flow_limits, only: most_halvings, middle_limit, square_limit, period_limit, &
        smallest_denominator, sin_cos_limit
    use frb_inertia, only: body_core
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: long_step

    logical, parameter :: with_attitude = .true.

contains

    include 'long_step.inc'

end module frb_flow_long
