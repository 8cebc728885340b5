!> The formulas of long steps in double precision: the very text that the library compiles.
module frb_double_flow_formulas
    use frb_kinds, only: wp
    implicit none
    private

    public :: orbit_difference, double_square, double_triple
    public :: base_angle, double_angle, long_momentum, long_direction, sin_cos

contains

    include '../src/flow/long_formulas.inc'

    include '../src/flow/angle_formulas.inc'

end module frb_double_flow_formulas
