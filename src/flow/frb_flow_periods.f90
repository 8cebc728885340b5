!> The period of the elliptic triple, by the arithmetic-geometric mean, for those who keep it.
module frb_flow_periods
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: quarter_period

contains

    include 'period_formulas.inc'

end module frb_flow_periods
