!> The formulas of the free flow in quadruple precision: the very text that the library compiles.
module frb_quad_flow_formulas
    use, intrinsic :: iso_fortran_env, only: wp => real128
    implicit none
    private

    public :: wp, short_series, short_third_kind, base_series, base_third_kind, small_turn, base_angle
    public :: short_momentum, long_momentum, unit_increment, join_turns, close_turn, turn
    public :: double_square, double_triple, double_angle, sin_cos

contains

    include '../src/flow/flow_formulas.inc'

end module frb_quad_flow_formulas
