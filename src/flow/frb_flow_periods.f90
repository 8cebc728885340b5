!> The period of the elliptic triple, by the arithmetic-geometric mean, for callers that store it.
module frb_flow_periods
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: quarter_period

contains

    include 'period_formulas.inc'

end module frb_flow_periods
