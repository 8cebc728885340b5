!> Carlson's symmetric elliptic integrals RF, RC, RJ and RD by duplication.
!>
!> With s(t) = sqrt(t+x) sqrt(t+y) sqrt(t+z):
!>
!>     RF(x,y,z)   = 1/2 int_0^inf dt/s(t)               RC(x,y)   = RF(x,y,y)
!>     RJ(x,y,z,p) = 3/2 int_0^inf dt/((t+p) s(t))       RD(x,y,z) = RJ(x,y,z,z)
!>
!> All four are homogeneous: RF and RC of degree -1/2, RJ and RD of degree -3/2. Huge and tiny arguments are
!> scaled by this law, so that no intermediate number overflows unless the result does. The integrals of
!> moderate arguments come from `frb_duplication`.
!>
!> Source: B. C. Carlson, Numerical computation of real or complex elliptic integrals, Numer. Algorithms 10
!> (1995) 13-26; DLMF 19.16, 19.20 and 19.36.
module frb_carlson
    use frb_duplication, only: rf_by_duplication, rj_by_duplication, rc_regular, rc_series
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: rf, rc, rj, rd, rf_and_rj

    !> For arguments between these bounds no intermediate product overflows, or loses digits by underflow.
    real(wp), parameter :: smallest_moderate = 1.0e-60_wp, largest_moderate = 1.0e60_wp

    !> Each step divides the ratio of p to x, y, z by about four; it can be as large as the range of numbers.
    integer, parameter :: most_extreme_steps = 1100

contains

    !> Integral of the first kind RF(x, y, z), symmetric in its arguments.
    !> Domain: x, y, z >= 0 and finite, at most one of them zero; outside: NaN.
    !> Accuracy: 4 epsilon, relative, over the whole domain; checked by carlson: rf-agrees-with-table.
    elemental function rf(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value
        real(wp) :: roots(3), lowest, highest
        integer :: shift

        if (.not. (ieee_is_finite(x) .and. ieee_is_finite(y) .and. ieee_is_finite(z))) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
            return
        end if
        lowest = min(x, y, z)
        highest = max(x, y, z)
        if (lowest < 0.0_wp .or. max(min(x, y), min(x, z), min(y, z)) <= 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
            return
        end if
        if (lowest >= smallest_moderate .and. highest <= largest_moderate) then
            value = rf_by_duplication(x, y, z)
        else
            ! One duplication makes all arguments moderate. The roots, between 1e-162 and 1e154, are scaled by
            ! a power of two, and x + lambda is formed as the product (sx + sy)(sx + sz).
            roots = sqrt([x, y, z])
            shift = 200 - exponent(maxval(roots))
            roots = scale(roots, shift)
            associate (sx => roots(1), sy => roots(2), sz => roots(3))
                value = rf_by_duplication(0.25_wp*(sx + sy)*(sx + sz), 0.25_wp*(sy + sx)*(sy + sz), &
                                          0.25_wp*(sz + sx)*(sz + sy))*scale(1.0_wp, shift)
            end associate
        end if
    end function rf

    !> Degenerate integral RC(x, y) = RF(x, y, y), an inverse circular (y > x) or hyperbolic (y < x) function:
    !> RC(1, 1+t**2) = atan(t)/t, RC(1, 1-t**2) = artanh(t)/t.
    !> For y < 0 the Cauchy principal value, sqrt(x/(x-y)) RC(x-y, -y).
    !> Domain: x >= 0, y /= 0, both finite; outside: NaN.
    !> Accuracy: 4 epsilon, relative; checked by carlson: rc-agrees-with-table.
    elemental function rc(x, y) result(value)
        real(wp), intent(in) :: x, y
        real(wp) :: value
        real(wp) :: difference

        if (.not. (ieee_is_finite(x) .and. ieee_is_finite(y))) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (x < 0.0_wp .or. abs(y) <= 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (y > 0.0_wp) then
            value = rc_regular(x, y)
        else if (y < -1.0_wp .and. x > 1.0_wp) then
            ! A quarter of the difference cannot overflow, and RC(4 v, 4 w) = RC(v, w)/2.
            difference = 0.25_wp*x - 0.25_wp*y
            value = 0.25_wp*(sqrt(x)/sqrt(difference))*rc_regular(difference, -0.25_wp*y)
        else
            difference = x - y
            value = (sqrt(x)/sqrt(difference))*rc_regular(difference, -y)
        end if
    end function rc

    !> Integral of the third kind RJ(x, y, z, p), symmetric in x, y, z.
    !> For p < 0 the Cauchy principal value, by DLMF 19.20.14, if all but the smallest of x, y, z and -p are
    !> within a factor 1e60 of one another; otherwise NaN.
    !> Domain: x, y, z >= 0, at most one of them zero, p /= 0, all finite; outside: NaN. A result beyond the
    !> largest number comes back as +Infinity.
    !> Accuracy: 6 epsilon, relative, for p > 0; checked by carlson: rj-agrees-with-table. For p < 0 the same
    !> multiple of the largest of the three terms, since the principal value has zeros.
    elemental function rj(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value

        if (is_moderate(x, y, z, p)) then
            call rj_by_duplication(x, y, z, p, value)
        else
            value = rj_rare(x, y, z, p)
        end if
    end function rj

    !> RD(x, y, z) = RJ(x, y, z, z), symmetric in x and y only; the integral of the second kind.
    !> Domain: x, y >= 0, not both zero, z > 0, all finite; outside: NaN. A result beyond the largest number
    !> comes back as +Infinity.
    !> Accuracy: 6 epsilon, relative; checked by carlson: rd-agrees-with-table.
    elemental function rd(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value

        if (.not. ieee_is_finite(z)) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (z <= 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else
            value = rj(x, y, z, z)
        end if
    end function rd

    !> RF(x, y, z) and RJ(x, y, z, p) together, at the cost of RJ: both share the duplications.
    !> Domain, errors and accuracy of each as in `rf` and `rj`.
    elemental subroutine rf_and_rj(x, y, z, p, first, third)
        real(wp), intent(in) :: x, y, z, p
        real(wp), intent(out) :: first   !! RF(x, y, z)
        real(wp), intent(out) :: third   !! RJ(x, y, z, p)

        if (is_moderate(x, y, z, p)) then
            call rj_by_duplication(x, y, z, p, third, first)
        else
            first = rf(x, y, z)
            third = rj_rare(x, y, z, p)
        end if
    end subroutine rf_and_rj

    ! ------------------------------------------------------------------------------------------ inner parts

    !> Whether RJ needs no scaling: all arguments in the domain, p > 0, and none of extreme size.
    pure function is_moderate(x, y, z, p) result(moderate)
        real(wp), intent(in) :: x, y, z, p
        logical :: moderate

        moderate = ieee_is_finite(x) .and. ieee_is_finite(y) .and. ieee_is_finite(z) .and. ieee_is_finite(p)
        if (moderate) moderate = min(x, y, z) >= 0.0_wp &
            .and. min(max(min(x, y), min(x, z), min(y, z)), p) >= smallest_moderate &
            .and. max(x, y, z, p) <= largest_moderate
    end function is_moderate

    !> RJ where `is_moderate` does not hold: outside the domain, p < 0, or arguments of extreme size.
    pure function rj_rare(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value

        if (.not. (ieee_is_finite(x) .and. ieee_is_finite(y) .and. ieee_is_finite(z) &
                   .and. ieee_is_finite(p))) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (min(x, y, z) < 0.0_wp .or. max(min(x, y), min(x, z), min(y, z)) <= 0.0_wp &
                 .or. abs(p) <= 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (p < 0.0_wp) then
            value = rj_principal_value(x, y, z, -p)
        else
            value = rj_extreme(x, y, z, p)
        end if
    end function rj_rare

    !> Cauchy principal value RJ(x, y, z, -q), q > 0. With x <= y <= z (DLMF 19.20.14):
    !>
    !>     (z + q) RJ(x, y, z, -q) = (p - z) RJ(x, y, z, p) - 3 RF(x, y, z)
    !>                               + 3 sqrt(x y z/(x y + p q)) RC(x y + p q, p q),
    !>
    !> p = (z (x + y + q) - x y)/(z + q). All arguments are first scaled by a power of four, so that the
    !> larger of z and q is about one; NaN if y, q or p is then not moderate.
    pure function rj_principal_value(x0, y0, z0, q0) result(value)
        real(wp), intent(in) :: x0, y0, z0, q0      !! in any order
        real(wp) :: value
        real(wp) :: x, y, z, q, p, first, third
        integer :: shift

        x = min(x0, y0, z0)
        z = max(x0, y0, z0)
        y = max(min(x0, y0), min(x0, z0), min(y0, z0))
        shift = -2*(exponent(max(z, q0))/2)
        x = scale(x, shift)
        y = scale(y, shift)
        z = scale(z, shift)
        q = scale(q0, shift)
        p = (z*(x + y + q) - x*y)/(z + q)
        if (min(y, q) < smallest_moderate .or. .not. is_moderate(x, y, z, p)) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
            return
        end if
        call rj_by_duplication(x, y, z, p, third, first)
        value = (p - z)*third - 3*first
        if (x > 0.0_wp) value = value + 3*sqrt(x*y*z/(x*y + p*q))*rc_regular(x*y + p*q, p*q)
        value = scaled_or_infinite(value/(z + q), 3*(shift/2))
    end function rj_principal_value

    !> RJ for p > 0 and arguments of any size. The duplications are done in the roots s = sqrt(x, y, z, p):
    !>
    !>     d = (sp + sx)(sp + sy)(sp + sz),     new x = (sx + sy)(sx + sz)/4, ..,     new p = (p + lambda)/4,
    !>     RJ = sum over steps n of 6 4**-n/d RC(1, 1 + e) + 4**-steps RJ(last arguments),
    !>     1 + e = 2 sp (p + lambda)/d,     e = (sp - sx)(sp - sy)(sp - sz)/d.
    !>
    !> Before each step the roots are scaled by a power of two, so that the largest is about 2**200. After n
    !> steps the arguments are 4**shifts times those of an unscaled sequence. Each term, of degree -3 in the
    !> roots, is a mantissa and a power of two; `add_scaled` collects them. The steps end when the roots are
    !> within a factor 1e20 of one another: scaled to about one, all arguments are then moderate.
    pure function rj_extreme(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value
        real(wp) :: s(4), pairs(3), grown, term, total
        integer :: shift, shifts, reference, power, n

        s = sqrt([x, y, z, p])
        total = 0.0_wp
        reference = -1000000   ! below any power of two that occurs
        shifts = 0
        do n = 0, most_extreme_steps
            if (minval(s) > 1.0e-20_wp*maxval(s)) exit
            shift = 200 - exponent(maxval(s))
            s = scale(s, shift)
            shifts = shifts + shift
            grown = s(4)*s(4) + (s(1)*(s(2) + s(3)) + s(2)*s(3))   ! p + lambda
            call extreme_term(s, grown, term, power)
            call add_scaled(term, power + 3*shifts - 2*n, total, reference)
            ! Products of roots, which cannot underflow.
            pairs = sqrt([s(1) + s(2), s(1) + s(3), s(2) + s(3)])
            s = 0.5_wp*[pairs(1)*pairs(2), pairs(1)*pairs(3), pairs(2)*pairs(3), sqrt(grown)]
        end do
        shift = -exponent(maxval(s))
        s = scale(s, shift)
        shifts = shifts + shift
        call rj_by_duplication(s(1)*s(1), s(2)*s(2), s(3)*s(3), s(4)*s(4), term)
        call add_scaled(term, 3*shifts - 2*n, total, reference)
        value = scaled_or_infinite(total, reference)
    end function rj_extreme

    !> 6/d RC(1, 1 + e) of `rj_extreme` as term 2**power.
    pure subroutine extreme_term(s, grown, term, power)
        real(wp), intent(in) :: s(4)        !! roots of x, y, z, p
        real(wp), intent(in) :: grown       !! p + lambda
        real(wp), intent(out) :: term
        integer, intent(out) :: power
        real(wp) :: sums(3), mantissas, e, w

        sums = s(4) + s(1:3)
        mantissas = fraction(sums(1))*fraction(sums(2))*fraction(sums(3))
        power = -sum(exponent(sums))
        e = ((s(4) - s(1))/sums(1))*((s(4) - s(2))/sums(2))*((s(4) - s(3))/sums(3))
        if (abs(e) <= 0.1_wp) then
            term = rc_series(e)
        else
            ! RC(1, 1 + e) = 2**100 RC(2**200, 2**200 (1 + e)): 1 + e may be as small as 1e-315.
            w = 2*fraction(s(4))*fraction(grown)/mantissas
            w = scale(w, 200 + exponent(s(4)) + exponent(grown) + power)
            term = scale(rc_regular(scale(1.0_wp, 200), w), 100)
        end if
        term = 6*term/mantissas
    end subroutine extreme_term

    !> Adds term 2**power to total 2**reference; the larger of the two exponents becomes `reference`.
    pure subroutine add_scaled(term, power, total, reference)
        real(wp), intent(in) :: term
        integer, intent(in) :: power
        real(wp), intent(inout) :: total
        integer, intent(inout) :: reference

        if (power > reference) then
            total = scale(total, max(reference - power, -3000))
            reference = power
        end if
        total = total + scale(term, max(power - reference, -3000))
    end subroutine add_scaled

    !> value 2**power, or +-Infinity where that would overflow; no exception is raised.
    pure function scaled_or_infinite(value, power) result(scaled)
        real(wp), intent(in) :: value
        integer, intent(in) :: power
        real(wp) :: scaled

        if (exponent(value) + power > maxexponent(1.0_wp) .and. abs(value) > 0.0_wp) then
            scaled = sign(ieee_value(1.0_wp, ieee_positive_inf), value)
        else
            scaled = scale(value, power)
        end if
    end function scaled_or_infinite

end module frb_carlson
