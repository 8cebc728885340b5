!> The truth of every chart: a Taylor-series integration in quadruple precision, independent of every formula
!> of the library.
module frb_taylor_truth
    use frb_kinds, only: qp
    implicit none
    private

    public :: qp, taylor_flow, taylor_period, long_truth

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/taylor.inc'

end module frb_taylor_truth
