!> Dual numbers of six directions, for derivatives by forward differentiation.
module frb_dual_numbers
    use frb_kinds, only: wp
    implicit none
    private

    public :: dual, variable, operator(+), operator(-), operator(*), operator(/), sqrt, sin, cos

    integer, parameter :: directions = 6

    type :: dual
        real(wp) :: v = 0.0_wp                  !! value
        real(wp) :: d(directions) = 0.0_wp      !! derivatives
    end type dual

    interface operator(+)
        module procedure plus, plus_real
    end interface operator(+)

    interface operator(-)
        module procedure minus, negative, real_minus
    end interface operator(-)

    interface operator(*)
        module procedure times, times_real, real_times
    end interface operator(*)

    interface operator(/)
        module procedure over
    end interface operator(/)

    interface sqrt
        module procedure dual_sqrt
    end interface sqrt

    interface sin
        module procedure dual_sin
    end interface sin

    interface cos
        module procedure dual_cos
    end interface cos

contains

    !> The value v that is varied in direction k.
    pure function variable(v, k) result(x)
        real(wp), intent(in) :: v
        integer, intent(in) :: k
        type(dual) :: x

        x%v = v
        x%d(k) = 1.0_wp
    end function variable

    elemental function plus(x, y) result(z)
        type(dual), intent(in) :: x, y
        type(dual) :: z

        z = dual(x%v + y%v, x%d + y%d)
    end function plus

    elemental function plus_real(x, y) result(z)
        real(wp), intent(in) :: x
        type(dual), intent(in) :: y
        type(dual) :: z

        z = dual(x + y%v, y%d)
    end function plus_real

    elemental function minus(x, y) result(z)
        type(dual), intent(in) :: x, y
        type(dual) :: z

        z = dual(x%v - y%v, x%d - y%d)
    end function minus

    elemental function negative(x) result(z)
        type(dual), intent(in) :: x
        type(dual) :: z

        z = dual(-x%v, -x%d)
    end function negative

    elemental function real_minus(x, y) result(z)
        real(wp), intent(in) :: x
        type(dual), intent(in) :: y
        type(dual) :: z

        z = dual(x - y%v, -y%d)
    end function real_minus

    elemental function times(x, y) result(z)
        type(dual), intent(in) :: x, y
        type(dual) :: z

        z = dual(x%v*y%v, x%v*y%d + y%v*x%d)
    end function times

    elemental function times_real(x, y) result(z)
        type(dual), intent(in) :: x
        real(wp), intent(in) :: y
        type(dual) :: z

        z = dual(x%v*y, x%d*y)
    end function times_real

    elemental function real_times(x, y) result(z)
        real(wp), intent(in) :: x
        type(dual), intent(in) :: y
        type(dual) :: z

        z = dual(x*y%v, x*y%d)
    end function real_times

    elemental function over(x, y) result(z)
        type(dual), intent(in) :: x, y
        type(dual) :: z

        z%v = x%v/y%v
        z%d = (x%d - z%v*y%d)/y%v
    end function over

    elemental function dual_sqrt(x) result(z)
        type(dual), intent(in) :: x
        type(dual) :: z

        z%v = sqrt(x%v)
        z%d = x%d/(2*z%v)
    end function dual_sqrt

    elemental function dual_sin(x) result(z)
        type(dual), intent(in) :: x
        type(dual) :: z

        z = dual(sin(x%v), cos(x%v)*x%d)
    end function dual_sin

    elemental function dual_cos(x) result(z)
        type(dual), intent(in) :: x
        type(dual) :: z

        z = dual(cos(x%v), -sin(x%v)*x%d)
    end function dual_cos

end module frb_dual_numbers
