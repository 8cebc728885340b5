!> The limits between the formulas of the free flow, shared by the routines for one body and for many.
!> P, R: the squares of the two frequencies, nu: the parameter of the third kind; t: the half step or a part.
module frb_flow_limits
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: most_halvings
    public :: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, middle_limit, middle_turn_limit
    public :: square_limit, period_limit, smallest_denominator, sin_cos_limit, plain_largest, plain_smallest
    public :: largest_bits, smallest_bits
    public :: separatrix, settled
    public :: tiny_step, short_step, middle_step, beyond_series

    !> The series that a step of one body uses.
    integer, parameter :: tiny_step = 1, short_step = 2, middle_step = 3, beyond_series = 4
    !> Most halvings of a time. 12 are needed; the bound ends a loop where a compiler assumes that there is no
    !> NaN.
    integer, parameter :: most_halvings = 16
    real(wp), parameter :: short_limit = 0.002_wp       !! largest max(P, R) (h/2)^2 of the short series
    real(wp), parameter :: tiny_limit = 1.0e-4_wp       !! largest max(P, R) (h/2)^2 of its first terms alone
    real(wp), parameter :: tiny_turn_limit = 1.0e-3_wp  !! largest square of a half angle of the first terms
    real(wp), parameter :: small_turn_limit = 0.04_wp   !! largest square of a half angle of the short series
    real(wp), parameter :: middle_limit = 0.03_wp       !! largest max(P, R) t^2 of the middle series
    real(wp), parameter :: middle_turn_limit = 0.6_wp   !! largest square of a half angle of the middle series
    real(wp), parameter :: square_limit = 0.8_wp        !! largest max(P, R) t^2 to which s^2 alone is doubled
    real(wp), parameter :: period_limit = 1024.0_wp     !! max(P, R) (h/2)^2 from which periods are taken out
    real(wp), parameter :: separatrix = 1.0e-200_wp     !! |R - P|/max(P, R) that counts as 0
    real(wp), parameter :: settled = 200.0_wp           !! half step times lambda that ends on the middle axis
    real(wp), parameter :: smallest_denominator = 1.0e-9_wp    !! of the triple, before a division
    real(wp), parameter :: sin_cos_limit = 1.5e6_wp     !! largest argument of sin_cos
    real(wp), parameter :: plain_largest = 1.0e75_wp    !! components whose squares and products are safe
    real(wp), parameter :: plain_smallest = 1.0e-75_wp
    !> Their bit patterns: those of numbers >= 0 have the order of the numbers, Inf and NaN above all, and to
    !> compare them raises no floating-point flag and takes less time in lanes.
    integer(int64), parameter :: largest_bits = transfer(plain_largest, 1_int64)
    integer(int64), parameter :: smallest_bits = transfer(plain_smallest, 1_int64)

end module frb_flow_limits
