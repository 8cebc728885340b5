!> The integrals of middle steps that the derivatives use, in quadruple precision: the very text that the
!> library compiles.
module frb_quad_tangent_formulas
    use frb_kinds, only: wp => qp
    implicit none
    private

    public :: middle_integrals

contains

    include '../src/flow/middle_polynomials.inc'

    include '../src/flow/tangent_middle_formulas.inc'

end module frb_quad_tangent_formulas
