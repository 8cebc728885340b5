!> The step of the free flow with automatic derivatives, in dual numbers: the rival of flow_tangent.
module frb_dual_steps
    use frb, only: wp
    implicit none
    private

    public :: dual_step, points

    include 'rivals/duals.inc'

end module frb_dual_steps
