!> The real kind of the library and constants of this kind; quadruple precision for tests and charts.
module frb_kinds
    use, intrinsic :: iso_fortran_env, only: int64, real64, real128
    implicit none
    private

    public :: wp, qp, has_quad, pi, half_pi, two_pi, unit_roundoff, most_points, is_number

    !> Working precision: IEEE double.
    integer, parameter :: wp = real64

    !> Quadruple precision, for the exact values in tests and charts. It is `wp` where the compiler has no
    !> quadruple precision: checks that need 30 digits ask `has_quad`.
    integer, parameter :: qp = merge(real128, real64, real128 > 0)
    logical, parameter :: has_quad = precision(1.0_qp) >= 30

    real(wp), parameter :: pi = 3.14159265358979323846264338327950288_wp
    real(wp), parameter :: half_pi = 1.57079632679489661923132169163975144_wp
    real(wp), parameter :: two_pi = 6.28318530717958647692528676655900577_wp

    !> Largest relative error of one rounding, 2^-53.
    real(wp), parameter :: unit_roundoff = epsilon(1.0_wp)/2

    !> Largest number of Gauss points, np, of a semi-exact step or of an integral.
    integer, parameter :: most_points = 1000

contains

    !> Whether x is neither NaN nor Inf, by its bits: with flags as -Ofast, ieee_is_finite is always true. For
    !> loops that would not end with such numbers.
    elemental function is_number(x) result(number)
        real(wp), intent(in) :: x
        logical :: number
        integer, parameter :: first_bit = 52, bits = 11     ! of the exponent

        number = ibits(transfer(x, 0_int64), first_bit, bits) < 2**bits - 1
    end function is_number

end module frb_kinds
