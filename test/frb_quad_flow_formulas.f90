!> The formulas of the free flow in quadruple precision: the very text that the library compiles.
module frb_quad_flow_formulas
    use frb_kinds, only: wp => qp
    implicit none
    private

    public :: wp, tiny_series, tiny_third_kind, short_series, short_momentum, short_direction
    public :: short_third_kind, small_turn, short_norm
    public :: small_unit_turn, middle_series, middle_third_kind
    public :: orbit_difference, double_square, double_triple
    public :: base_angle, double_angle, long_momentum, long_direction, sin_cos, join_turns, turn

contains

    include '../src/flow/series_formulas.inc'

    include '../src/flow/short_coefficients.inc'

    include '../src/flow/short_third_kind.inc'

    include '../src/flow/tiny_formulas.inc'

    include '../src/flow/tiny_third_kind.inc'

    include '../src/flow/short_formulas.inc'

    include '../src/flow/unit_turn_formulas.inc'

    include '../src/flow/middle_formulas.inc'

    include '../src/flow/middle_coefficients.inc'

    include '../src/flow/middle_third_kind.inc'

    include '../src/flow/long_formulas.inc'

    include '../src/flow/angle_formulas.inc'

    include '../src/flow/turn_formulas.inc'

    include '../src/flow/join_formulas.inc'

end module frb_quad_flow_formulas
