!> The closed form of the free flow with automatic derivatives, from the text that the charts compile.
module frb_dual_flow
    use frb_kinds, only: wp
    implicit none
    private

    public :: dual_step, points

    include '../app/charts/rivals/duals.inc'

end module frb_dual_flow
