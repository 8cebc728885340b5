!> The rivals of the charts in quadruple precision: the very texts that the chart program times.
!> fpm does not see changes of included files: remove build/ after one.
module frb_quad_dmv
    use frb_kinds, only: rk => qp
    implicit none
    private

    public :: rk, dmv_body, new_dmv_body, dmv_steps

    include '../app/charts/rivals/dmv.inc'

end module frb_quad_dmv

module frb_quad_rotations
    use frb_kinds, only: rk => qp
    implicit none
    private

    public :: rotation_steps

    include '../app/charts/rivals/rotations.inc'

end module frb_quad_rotations

module frb_quad_runge_kutta
    use frb_kinds, only: rk => qp
    implicit none
    private

    public :: rk4_steps, dormand_prince

    include '../app/charts/rivals/runge_kutta.inc'

    include '../app/charts/rivals/dormand_prince.inc'

end module frb_quad_runge_kutta

module frb_quad_truth
    use frb_kinds, only: qp
    implicit none
    private

    public :: taylor_flow, taylor_period, long_truth

    include '../app/charts/rivals/taylor.inc'

end module frb_quad_truth

module frb_quad_top
    use frb_kinds, only: qp
    implicit none
    private

    public :: taylor_top

    include '../app/charts/rivals/taylor_top.inc'

end module frb_quad_top
