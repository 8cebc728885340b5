!> The truth of the charts with torque: a heavy top by Taylor series in quadruple precision.
module frb_top_truth
    use frb_kinds, only: qp
    implicit none
    private

    public :: qp, taylor_top

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/taylor_top.inc'

end module frb_top_truth
