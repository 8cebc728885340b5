!> Carlson's symmetric elliptic integrals RF, RC, RJ and RD by duplication.
!>
!> With s(t) = sqrt(t+x) sqrt(t+y) sqrt(t+z):
!>
!>     RF(x,y,z)   = 1/2 int_0^inf dt/s(t)               RC(x,y)   = RF(x,y,y)
!>     RJ(x,y,z,p) = 3/2 int_0^inf dt/((t+p) s(t))       RD(x,y,z) = RJ(x,y,z,z)
!>
!> One duplication replaces each argument v by (v + lambda)/4, lambda = sqrt(x y) + sqrt(x z) + sqrt(y z), and
!> draws the arguments together four times closer. Then a Taylor series about their mean finishes the work;
!> it is taken further than usual (degree 11 for RF, 9 for RJ), since one more duplication costs more than a
!> dozen terms. All four are homogeneous, of degree -1/2 (RF, RC) and -3/2 (RJ, RD), and this is used to scale
!> huge and tiny arguments, so that nothing overflows unless the result does.
!>
!> Source: B. C. Carlson, Numerical computation of real or complex elliptic integrals, Numer. Algorithms 10
!> (1995) 13-26; DLMF 19.16, 19.19.7 (the series), 19.20 and 19.36.
module frb_carlson
    use frb_kinds, only: wp, pi, half_pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: rf, rc, rj, rd, rf_and_rj

    !> Largest relative distance from the mean at which the series are good to a quarter of an ulp.
    !> A bound for NaN, where a compiler assumes that there is none.
    integer, parameter :: most_duplications = 4096
    real(wp), parameter :: rf_radius = 0.055_wp
    real(wp), parameter :: rj_radius = 0.020_wp

    !> Between these bounds no product formed on the way can overflow or lose digits to underflow.
    real(wp), parameter :: smallest_plain = 1.0e-60_wp, largest_plain = 1.0e60_wp

    !> A p above x, y, z by the full range of numbers comes down to them by a factor of four a step.
    integer, parameter :: most_extreme_steps = 1100

contains

    !> Integral of the first kind RF(x, y, z), symmetric in its arguments.
    !> Domain: x, y, z >= 0 and finite, at most one of them zero; outside: NaN.
    !> Accuracy: 4 epsilon, relative, over the whole domain; checked by carlson: rf-agrees-with-table.
    elemental function rf(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value
        real(wp) :: xn, yn, zn, lowest, highest, scaling

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
        xn = x
        yn = y
        zn = z
        scaling = 1.0_wp
        if (lowest < smallest_plain .or. highest > largest_plain) call scaled_duplication(xn, yn, zn, scaling)
        call rf_duplications(xn, yn, zn)
        value = rf_series(xn, yn, zn)*scaling
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
            ! a quarter of the difference, which cannot overflow; RC(4 v, 4 w) = RC(v, w)/2
            difference = 0.25_wp*x - 0.25_wp*y
            value = 0.25_wp*(sqrt(x)/sqrt(difference))*rc_regular(difference, -0.25_wp*y)
        else
            difference = x - y
            value = (sqrt(x)/sqrt(difference))*rc_regular(difference, -y)
        end if
    end function rc

    !> Integral of the third kind RJ(x, y, z, p), symmetric in x, y, z.
    !> For p < 0 the Cauchy principal value, by DLMF 19.20.14, as long as all but the smallest of x, y, z and
    !> -p are within a factor 1e60 of one another, else NaN.
    !> Domain: x, y, z >= 0, at most one of them zero, p /= 0, all finite; outside: NaN. A result beyond the
    !> largest number comes back as +Infinity.
    !> Accuracy: 6 epsilon, relative, for p > 0; checked by carlson: rj-agrees-with-table. For p < 0 the same
    !> multiple of the largest of the three terms, since the principal value has zeros.
    elemental function rj(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value
        real(wp) :: xn, yn, zn, pn, total, quarter

        if (rj_is_plain(x, y, z, p)) then
            xn = x
            yn = y
            zn = z
            pn = p
            call rj_duplications(xn, yn, zn, pn, total, quarter)
            value = total + quarter*rj_series(xn, yn, zn, pn)
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

    !> RF(x, y, z) and RJ(x, y, z, p) together, for the price of RJ: they share the duplications.
    !> Domain, errors and accuracy of each as in `rf` and `rj`.
    elemental subroutine rf_and_rj(x, y, z, p, first, third)
        real(wp), intent(in) :: x, y, z, p
        real(wp), intent(out) :: first   !! RF(x, y, z)
        real(wp), intent(out) :: third   !! RJ(x, y, z, p)
        real(wp) :: xn, yn, zn, pn, total, quarter

        if (rj_is_plain(x, y, z, p)) then
            xn = x
            yn = y
            zn = z
            pn = p
            call rj_duplications(xn, yn, zn, pn, total, quarter)
            third = total + quarter*rj_series(xn, yn, zn, pn)
            first = rf_series(xn, yn, zn)
        else
            first = rf(x, y, z)
            third = rj_rare(x, y, z, p)
        end if
    end subroutine rf_and_rj

    ! ------------------------------------------------------------------------------------------ RF and RC

    !> Duplications until x, y, z are within `rf_radius` of their mean.
    pure subroutine rf_duplications(x, y, z)
        real(wp), intent(inout) :: x, y, z
        real(wp) :: sx, sy, sz, lambda, mean, distance
        integer :: n

        mean = (x + y + z)/3
        distance = max(abs(mean - x), abs(mean - y), abs(mean - z))/rf_radius
        do n = 1, most_duplications
            if (distance <= mean) exit
            sx = sqrt(x)
            sy = sqrt(y)
            sz = sqrt(z)
            lambda = sx*(sy + sz) + sy*sz
            x = 0.25_wp*(x + lambda)
            y = 0.25_wp*(y + lambda)
            z = 0.25_wp*(z + lambda)
            mean = 0.25_wp*(mean + lambda)
            distance = 0.25_wp*distance
        end do
    end subroutine rf_duplications

    !> RF by its series about the mean, to degree 11 in the relative distances (DLMF 19.19.7). The distances
    !> are formed anew: their absolute error of an ulp is multiplied by a distance in e2, e3.
    pure function rf_series(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value
        real(wp) :: mean, inverse, dx, dy, dz, e2, e3

        mean = (x + y + z)*(1.0_wp/3)
        inverse = 1/mean
        dx = (mean - x)*inverse
        dy = (mean - y)*inverse
        dz = -(dx + dy)
        e2 = dx*dy - dz*dz
        e3 = dx*dy*dz
        value = (e2*(-1.0_wp/10 + e2*(1.0_wp/24 + e2*(-5.0_wp/208 + e2*(35.0_wp/2176 - e2*(3.0_wp/256))))) &
                 + e3*(1.0_wp/14 + e2*(-3.0_wp/44 + e2*(1.0_wp/16 + e2*(-35.0_wp/608 + e2*(315.0_wp/5888)))) &
                       + e3*(3.0_wp/104 + e2*(-15.0_wp/272 + e2*(5.0_wp/64)) &
                             + e3*(5.0_wp/304 - e2*(35.0_wp/736)))))
        value = (1 + value)/sqrt(mean)
    end function rf_series

    !> One duplication for arguments of any size, after which all are moderate. The square roots, between
    !> 1e-162 and 1e154, are scaled by a power of two, and x + lambda is formed as (sx + sy)(sx + sz).
    pure subroutine scaled_duplication(x, y, z, scaling)
        real(wp), intent(inout) :: x, y, z
        real(wp), intent(out) :: scaling   !! RF(old) = scaling RF(new)
        real(wp) :: sx, sy, sz
        integer :: shift

        sx = sqrt(x)
        sy = sqrt(y)
        sz = sqrt(z)
        shift = 200 - exponent(max(sx, sy, sz))
        sx = scale(sx, shift)
        sy = scale(sy, shift)
        sz = scale(sz, shift)
        x = 0.25_wp*(sx + sy)*(sx + sz)
        y = 0.25_wp*(sy + sx)*(sy + sz)
        z = 0.25_wp*(sz + sx)*(sz + sy)
        scaling = scale(1.0_wp, shift)
    end subroutine scaled_duplication

    !> RC for x >= 0, y > 0.
    pure function rc_regular(x, y) result(value)
        real(wp), intent(in) :: x, y
        real(wp) :: value
        real(wp) :: root, sx, sy

        if (abs(y - x) <= 0.1_wp*x) then
            value = rc_series((y - x)/x)/sqrt(x)
        else if (y > x) then
            root = sqrt(y - x)
            value = atan2(root, sqrt(x))/root
        else
            root = sqrt(x - y)
            sx = sqrt(x)
            sy = sqrt(y)
            if (sx > 1.0e150_wp*sy) then
                value = (log(2*sx) - log(sy))/root   ! both logarithms count with the same sign
            else
                value = log((sx + root)/sy)/root
            end if
        end if
    end function rc_regular

    !> RC(1, 1 + e) = 1 - e/3 + e**2/5 - ... for |e| <= 0.1.
    pure function rc_series(e) result(value)
        real(wp), intent(in) :: e
        real(wp) :: value
        real(wp) :: e2, e4

        e2 = e*e
        if (e2 <= 1.0e-6_wp) then
            value = 1 - e*(1.0_wp/3 - e*(1.0_wp/5 - e*(1.0_wp/7 - e*(1.0_wp/9 - e*(1.0_wp/11)))))
        else
            e4 = e2*e2
            value = 1 - e*((1.0_wp/3 - e*(1.0_wp/5)) + e2*(1.0_wp/7 - e*(1.0_wp/9)) &
                           + e4*((1.0_wp/11 - e*(1.0_wp/13)) + e2*(1.0_wp/15 - e*(1.0_wp/17)) &
                           + e4*((1.0_wp/19 - e*(1.0_wp/21)) + e2*(1.0_wp/23 - e*(1.0_wp/25)) &
                           + e4*((1.0_wp/27 - e*(1.0_wp/29)) + e2*(1.0_wp/31)))))
        end if
    end function rc_series

    ! ------------------------------------------------------------------------------------------ RJ

    !> Whether the fast path of RJ is open: in the domain, p > 0 and no argument of extreme size.
    pure function rj_is_plain(x, y, z, p) result(plain)
        real(wp), intent(in) :: x, y, z, p
        logical :: plain

        plain = ieee_is_finite(x) .and. ieee_is_finite(y) .and. ieee_is_finite(z) .and. ieee_is_finite(p)
        if (plain) plain = min(x, y, z) >= 0.0_wp &
            .and. min(max(min(x, y), min(x, z), min(y, z)), p) >= smallest_plain &
            .and. max(x, y, z, p) <= largest_plain
    end function rj_is_plain

    !> Duplications until x, y, z, p are within `rj_radius` of their mean; then, with the changed arguments,
    !> RJ = total + quarter RJ(x, y, z, p) and RF is unchanged.
    !> total = sum of 6 4**-n/d_n RC(1, 1 + e_n), e_n = delta/(64**n d_n**2), (Carlson 1995, section 2.3).
    pure subroutine rj_duplications(x, y, z, p, total, quarter)
        real(wp), intent(inout) :: x, y, z, p
        real(wp), intent(out) :: total, quarter
        real(wp) :: sx, sy, sz, sp, lambda, mean, distance, d, inverse, delta, e
        integer :: n

        total = 0.0_wp
        quarter = 1.0_wp
        mean = 0.2_wp*(x + y + z + 2*p)
        distance = max(abs(mean - x), abs(mean - y), abs(mean - z), abs(mean - p))/rj_radius
        delta = (p - x)*(p - y)*(p - z)
        do n = 1, most_duplications
            if (distance <= mean) exit
            sx = sqrt(x)
            sy = sqrt(y)
            sz = sqrt(z)
            sp = sqrt(p)
            lambda = sx*(sy + sz) + sy*sz
            d = (sp + sx)*((sp + sy)*(sp + sz))
            inverse = 1/d
            e = delta*inverse*inverse
            if (abs(e) <= 0.1_wp) then
                total = total + 6*quarter*inverse*rc_series(e)
            else
                ! 1 + e = 2 sp (p + lambda)/d without the cancellation of 1 + e as p tends to 0
                total = total + 6*quarter*inverse*rc_regular(1.0_wp, 2*sp*(p + lambda)*inverse)
            end if
            x = 0.25_wp*(x + lambda)
            y = 0.25_wp*(y + lambda)
            z = 0.25_wp*(z + lambda)
            p = 0.25_wp*(p + lambda)
            mean = 0.25_wp*(mean + lambda)
            distance = 0.25_wp*distance
            quarter = 0.25_wp*quarter
            delta = delta*(1.0_wp/64)
        end do
    end subroutine rj_duplications

    !> RJ by its series about the mean, to degree 9 in the relative distances (DLMF 19.19.7).
    pure function rj_series(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value
        real(wp) :: mean, inverse, dx, dy, dz, dp, xyz, pp, e2, e3, e4, e5

        mean = 0.2_wp*(x + y + z + 2*p)
        inverse = 1/mean
        dx = (mean - x)*inverse
        dy = (mean - y)*inverse
        dz = (mean - z)*inverse
        dp = -0.5_wp*(dx + dy + dz)
        pp = dp*dp
        xyz = dx*dy*dz
        e2 = dx*(dy + dz) + dy*dz - 3*pp
        e3 = xyz + 2*dp*(e2 + 2*pp)
        e4 = dp*(2*xyz + dp*(e2 + 3*pp))
        e5 = xyz*pp
        value = e2*(-3.0_wp/14 + e2*(9.0_wp/88 + e2*(-1.0_wp/16 + e2*(105.0_wp/2432)))) &
            + e3*(1.0_wp/6 + e2*(-9.0_wp/52 + e2*(45.0_wp/272 - e2*(5.0_wp/32))) &
                  + e3*(3.0_wp/40 - e2*(45.0_wp/304) + e3*(5.0_wp/112))) &
            + e4*(-3.0_wp/22 + e2*(3.0_wp/20 - e2*(45.0_wp/304)) + e4*(9.0_wp/152) &
                  + e3*(-9.0_wp/68 + e2*(15.0_wp/56))) &
            + e5*(3.0_wp/26 + e2*(-9.0_wp/68 + e2*(15.0_wp/112)) + e3*(9.0_wp/76) - e4*(3.0_wp/28))
        value = (1 + value)*inverse/sqrt(mean)
    end function rj_series

    !> RJ off the fast path: outside the domain, p < 0, or arguments of extreme size.
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

    !> Cauchy principal value RJ(x0, y0, z0, -q), q > 0 (DLMF 19.20.14).
    pure function rj_principal_value(x0, y0, z0, q) result(value)
        real(wp), intent(in) :: x0, y0, z0, q
        real(wp) :: value
        real(wp) :: lowest, middle, highest, p, denominator, first, third, factor
        real(wp) :: x, y, z, positive, total, quarter
        integer :: shift

        lowest = min(x0, y0, z0)
        highest = max(x0, y0, z0)
        middle = max(min(x0, y0), min(x0, z0), min(y0, z0))
        ! scaled by a power of four so that the larger of highest and q is about one
        shift = -2*(exponent(max(highest, q))/2)
        lowest = scale(lowest, shift)
        middle = scale(middle, shift)
        highest = scale(highest, shift)
        factor = scale(q, shift)
        denominator = highest + factor
        p = (highest*(lowest + middle + factor) - lowest*middle)/denominator
        if (min(middle, factor) < smallest_plain .or. .not. rj_is_plain(lowest, middle, highest, p)) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
            return
        end if
        x = lowest
        y = middle
        z = highest
        positive = p
        call rj_duplications(x, y, z, positive, total, quarter)
        third = total + quarter*rj_series(x, y, z, positive)
        first = rf_series(x, y, z)
        value = (p - highest)*third - 3*first
        if (lowest > 0.0_wp) value = value + 3*sqrt(lowest*middle*highest/(lowest*middle + p*factor)) &
            *rc(lowest*middle + p*factor, p*factor)
        value = scaled_or_infinite(value/denominator, 3*(shift/2))
    end function rj_principal_value

    !> RJ for p > 0 and arguments of any size: duplications in square roots scaled by powers of two, with the
    !> exponent kept apart, until the arguments are close enough for the fast path.
    pure function rj_extreme(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value
        real(wp) :: s(4), sums(3), v(4), e, w, mantissas, grown, term, total, quarter, weight
        integer :: shift, shifts, reference, power, n

        s = sqrt([x, y, z, p])
        total = 0.0_wp
        reference = -1000000   ! below any power of two met
        shifts = 0      ! arguments of step n are 4**(shifts) times their true values / 4**n
        do n = 0, most_extreme_steps
            if (minval(s) > 1.0e-20_wp*maxval(s)) exit
            shift = 200 - exponent(maxval(s))
            s = scale(s, shift)
            shifts = shifts + shift
            sums = s(4) + s(1:3)
            mantissas = fraction(sums(1))*fraction(sums(2))*fraction(sums(3))
            grown = s(4)*s(4) + (s(1)*(s(2) + s(3)) + s(2)*s(3))   ! p + lambda
            ! 6 4**-n/d_n RC(1, 1+e_n), 1 + e_n = 2 sp (p + lambda)/d_n, in parts: mantissa and power of two
            e = ((s(4) - s(1))/sums(1))*((s(4) - s(2))/sums(2))*((s(4) - s(3))/sums(3))
            if (abs(e) <= 0.1_wp) then
                term = rc_series(e)
            else
                ! RC(1, w) = 2**100 RC(2**200, 2**200 w), since w may be as small as 1e-315
                w = 2*fraction(s(4))*fraction(grown)/mantissas
                term = scale(rc_regular(scale(1.0_wp, 200), scale(w, 200 + exponent(s(4)) + exponent(grown) &
                                                                  - sum(exponent(sums)))), 100)
            end if
            term = 6*term/mantissas
            power = 3*shifts - sum(exponent(sums)) - 2*n
            call add_scaled(term, power, total, reference)
            ! roots of (x + lambda)/4 = (sx + sy)(sx + sz)/4 .. as products, which cannot underflow
            v(1:3) = sqrt([s(1) + s(2), s(1) + s(3), s(2) + s(3)])
            v(4) = sqrt(grown)
            s = 0.5_wp*[v(1)*v(2), v(1)*v(3), v(2)*v(3), v(4)]
        end do
        shift = -exponent(maxval(s))
        s = scale(s, shift)
        shifts = shifts + shift
        v = s*s
        ! what remains is 4**-n RJ(true) with true = v 4**-shifts
        quarter = 1.0_wp
        call rj_duplications(v(1), v(2), v(3), v(4), weight, quarter)
        value = weight + quarter*rj_series(v(1), v(2), v(3), v(4))
        call add_scaled(value, 3*shifts - 2*n, total, reference)
        value = scaled_or_infinite(total, reference)
    end function rj_extreme

    !> total 2**reference grows by term 2**power; the larger of the two exponents is kept.
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
