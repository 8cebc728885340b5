!> The series of the free flow, coefficient by coefficient: in quadruple precision each equals the sum of the
!> terms that its recursion gives, at arguments far larger than in use. In double precision rounding would
!> hide a wrong last coefficient.
module frb_test_flow_series
    use frb_checks, only: tally, largest, worst_of
    use frb_double_flow_formulas, only: sin_cos
    use frb_flow_limits, only: sin_cos_limit
    use frb_kinds, only: rp => wp, has_quad
    use frb_quad_flow_formulas, only: wp, tiny_series, tiny_third_kind, short_series, short_third_kind, &
        middle_series, middle_third_kind, small_turn, short_norm, double_square, double_triple
    use frb_quad_tangent_formulas, only: middle_integrals
    implicit none
    private

    public :: test_flow_series

    real(rp), parameter :: rounding = 1.0e-31_rp
    integer, parameter :: most = 20

contains

    subroutine test_flow_series(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-series', 11)
        if (t%provided(has_quad, 10, 'coefficients, which need 30 digits')) call check_coefficients(t)
        call t%at_most('sine-and-cosine-of-any-turn-are-good-to-an-ulp-of-one', turn_error(), epsilon(1.0_rp))
        call t%close_suite()
    end subroutine test_flow_series

    !> Each formula against its series.
    subroutine check_coefficients(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: arguments(2, 4) = reshape([0.7_wp, 0.3_wp, 0.1_wp, 0.9_wp, 0.0_wp, 0.8_wp, &
                                                          0.6_wp, 0.6_wp], [2, 4])
        real(wp) :: s_terms(0:most), y_terms(0:most), p, r, n, s, y, z, scd, c, d, sinc, cosm1, dd, aa, bb
        real(rp) :: error(10)
        integer :: i, k

        error = 0.0_rp
        do i = 1, 4
            p = arguments(1, i)
            r = arguments(2, i)
            n = 0.4_wp*i
            call square_series(p, r, y_terms)
            call middle_series(p + r, p*r, y, scd)
            error(1) = worst_of(error(1), real(abs([y - sum(y_terms(:8)), &
                                                      scd - sum([((k + 1)*y_terms(k), k=0, 9)])]), rp))
            call short_series(p + r, p*r, y, scd)
            error(2) = worst_of(error(2), real(abs(y - sum(y_terms(:5))), rp))
            error(3) = worst_of(error(3), real(abs(scd - sum([((k + 1)*y_terms(k), k=0, 5)])), rp))
            error(4) = worst_of(error(4), real(abs(middle_third_kind(p, r, n) - third_kind(p, r, n, 8)), rp))
            call middle_integrals(p, r, dd, aa, bb)
            error(10) = worst_of(error(10), real(abs([dd - third_kind(p, r, 0.0_wp, 8), &
                                                      aa - third_kind(p, r, -p, 9), &
                                                      bb - third_kind(p, r, -r, 9)]), rp))
            error(5) = worst_of(error(5), &
                                real(abs(short_third_kind(p + r, p*r, n) &
                                         - whole_third_kind(y_terms, n, 4)), rp))
            ! s at t = 1/16 from its series, to 1e-34, doubled twice in each way to t = 1/4.
            call triple_series(p/256, r/256, s_terms)
            s = sum(s_terms)/16
            y = s*s
            c = sqrt(1 - max(p, r)*y)
            d = sqrt(1 - min(p, r)*y)
            z = 1.0_wp
            do k = 1, 2
                call double_triple(max(p, r), abs(r - p), s, c, d, z)
            end do
            s = s/z
            scd = s*(c/z)*(d/z)
            z = 1.0_wp
            do k = 1, 2
                call double_square(p, r, y, c, d, z)
            end do
            n = sqrt(y)/z
            call triple_series(p/16, r/16, s_terms)
            error(6) = worst_of(error(6), &
                                real(abs([s - sum(s_terms)/4, n - sum(s_terms)/4, scd - n*(c/z)*(d/z)]), rp))
        end do
        error(9) = tiny_error()
        call small_turn(0.5_wp, sinc, cosm1)
        s = 0.0_wp
        c = 0.0_wp
        p = 1.0_wp
        do k = 0, 5
            if (k > 0) c = c + p*(-0.5_wp)**k
            s = s + p/(2*k + 1)*(-0.5_wp)**k
            p = p/((2*k + 1)*(2*k + 2))
        end do
        error(7) = largest(real(abs([sinc - s, cosm1 - c]), rp))
        ! 1/sqrt(1 + x) - 1 to degree 7 by its binomial coefficients.
        s = 0.0_wp
        c = 1.0_wp
        do k = 1, 7
            c = -c*(2*k - 1)/(2*k)*0.5_wp
            s = s + c
        end do
        error(8) = real(abs(short_norm(0.5_wp) - s), rp)
        call t%at_most('s-squared-and-derivative-of-a-middle-step-are-their-series', error(1), &
                       rounding)
        call t%at_most('s-squared-of-a-short-step-is-its-series-to-degree-5', error(2), rounding)
        call t%at_most('derivative-of-s-squared-is-its-series-to-degree-5', error(3), rounding)
        call t%at_most('integral-of-a-middle-step-is-its-series-to-degree-8', error(4), rounding)
        call t%at_most('integrals-of-a-middle-step-are-their-series-to-degrees-8-and-9', error(10), rounding)
        call t%at_most('integral-of-a-short-step-is-its-series-to-degree-4', error(5), rounding)
        call t%at_most('doublings-of-the-triple-agree', error(6), rounding)
        call t%at_most('sine-and-cosine-of-a-small-turn-are-their-series', error(7), rounding)
        call t%at_most('norm-of-a-short-step-is-its-series', error(8), rounding)
        call t%at_most('first-terms-are-those-of-the-series', error(9), rounding)
    end subroutine check_coefficients

    !> Largest error of sin_cos over its range, the neighbours of multiples of pi/4 included.
    function turn_error() result(error)
        real(rp) :: error
        real(wp), parameter :: quarter = atan(1.0_wp)
        integer, parameter :: many = 20000
        real(rp) :: x, sine, cosine
        integer :: i

        error = 0.0_rp
        do i = -many, many
            x = sin_cos_limit*(real(i, rp)/many)
            if (modulo(i, 2) == 0) x = real(nint(x/quarter)*quarter, rp)
            if (abs(x) > sin_cos_limit) cycle
            call sin_cos(x, sine, cosine)
            error = worst_of(error, real(abs([sine - sin(real(x, wp)), cosine - cos(real(x, wp))]), rp))
        end do
    end function turn_error

    !> The short series have the first coefficients of the whole series: checked at arguments so small that
    !> the terms left out are below quadruple precision.
    function tiny_error() result(error)
        real(rp) :: error
        real(wp), parameter :: p = 3.0e-9_wp, r = 5.0e-9_wp, smaller = 1.0e-3_wp
        real(wp) :: y(2), scd(2)

        call tiny_series(p + r, p*r, y(1), scd(1))
        call short_series(p + r, p*r, y(2), scd(2))
        error = largest(real(abs([y(1) - y(2), scd(1) - scd(2), &
                              tiny_third_kind((p + r)*smaller, p*r*smaller**2, r*smaller) &
                              - short_third_kind((p + r)*smaller, p*r*smaller**2, r*smaller)]), rp))
    end function tiny_error

    !> Coefficients of s/t in t^2, at t = 1, from s'' = -(P + R) s + 2 P R s^3, s(0) = 0, s'(0) = 1.
    pure subroutine triple_series(p, r, terms)
        real(wp), intent(in) :: p, r
        real(wp), intent(out) :: terms(0:most)
        real(wp) :: square(0:most), cube
        integer :: k

        terms = 0.0_wp
        square = 0.0_wp
        terms(0) = 1.0_wp
        terms(1) = -(p + r)/6
        do k = 1, most - 1
            ! s^3 starts at t^3: its term of t^(2k+1) is the product of degree k - 1.
            square(k - 1) = dot_product(terms(:k - 1), terms(k - 1:0:-1))
            cube = dot_product(square(:k - 1), terms(k - 1:0:-1))
            terms(k + 1) = (2*p*r*cube - (p + r)*terms(k))/((2*k + 2)*(2*k + 3))
        end do
    end subroutine triple_series

    !> Coefficients of y/t^2 in t^2, at t = 1, from y'' = 2 - 4 (P + R) y + 6 P R y^2.
    pure subroutine square_series(p, r, terms)
        real(wp), intent(in) :: p, r
        real(wp), intent(out) :: terms(0:most)
        real(wp) :: square
        integer :: k

        terms = 0.0_wp
        terms(0) = 1.0_wp
        do k = 1, most
            square = 0.0_wp
            if (k >= 2) square = dot_product(terms(:k - 2), terms(k - 2:0:-1))
            terms(k) = (6*p*r*square - 4*(p + r)*terms(k - 1))/((2*k + 2)*(2*k + 1))
        end do
    end subroutine square_series

    !> The sum to degree `last` of h_k/(2k+3): h_k = g_k - n h_(k-1), g_k the coefficients of
    !> ((1 - u x)(1 - w x))^(-1/2), (k+1) g_(k+1) = (2k+1) (u+w)/2 g_k - k u w g_(k-1).
    pure function third_kind(u, w, n, last) result(total)
        real(wp), intent(in) :: u, w, n
        integer, intent(in) :: last
        real(wp) :: total
        real(wp) :: g, before, next, h
        integer :: k

        g = 1.0_wp
        before = 0.0_wp
        h = 1.0_wp
        total = h/3
        do k = 0, last - 1
            next = ((2*k + 1)*(u + w)/2*g - k*u*w*before)/(k + 1)
            before = g
            g = next
            h = g - n*h
            total = total + h/(2*k + 5)
        end do
    end function third_kind

    !> The sum to degree `last` of z_k/(2k+3), z_k the coefficients of z = y/(1 + n y) from those of y:
    !> z = y - n y z.
    pure function whole_third_kind(y_terms, n, last) result(total)
        real(wp), intent(in) :: y_terms(0:most), n
        integer, intent(in) :: last
        real(wp) :: total
        real(wp) :: z(0:last)
        integer :: k

        total = 0.0_wp
        do k = 0, last
            z(k) = y_terms(k)
            if (k > 0) z(k) = z(k) - n*dot_product(y_terms(:k - 1), z(k - 1:0:-1))
            total = total + z(k)/(2*k + 3)
        end do
    end function whole_third_kind

end module frb_test_flow_series
