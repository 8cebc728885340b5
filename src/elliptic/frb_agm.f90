!> Elliptic integral of the first kind and Jacobi elliptic functions by the arithmetic-geometric mean and
!> Landen's transformation, section 3.2.
!>
!> The argument is the modulus k, 0 <= |k| <= 1, as in the paper. Close to k = 1 all functions depend on
!> 1 - k**2. Each routine takes this number as an optional kc2, so that no digit is lost; k is then not used.
!>
!> The sequence a(n+1) = (a(n) + b(n))/2, b(n+1) = sqrt(a(n) b(n)) from a = 1, b = sqrt(1 - k**2) carries the
!> amplitude by (17), tan(phi(n+1) - phi(n)) = (b(n)/a(n)) tan(phi(n)), and F(phi) = phi(N)/(2**N a(N)).
!> Here it is written in y(n) = 2**n a(n) cot(phi(n)) and w(n) = sqrt(y(n)**2 + 4**n b(n)**2):
!>
!>     y(n+1) = y(n) - 4**n a(n) b(n)/y(n),      w(n+1) = y(n) + 4**n a(n) b(n)/y(n),
!>
!> so a step up costs one division. A step down, y(n) = (w(n+1) +- y(n+1))/2, costs one square root. Neither
!> needs a tangent or an arcsine. At the end y(0) = cn/sn and w(0) = dn/sn, without cancellation as k tends to
!> 1. Once a and b are close, three terms of a series in c = (a - b)/(a + b), here called the gap, replace the
!> last two or three steps. The cotangent does not see half turns, so their number is kept beside it: each
!> step up doubles the number and adds one where y(n) < 0. On the way down the lowest bit of the number gives
!> the sign of y(n).
module frb_agm
    use frb_complements, only: modulus_complement
    use frb_kinds, only: wp, pi, half_pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: ellip_k, ellip_f, jacobi_am, jacobi, landen_step, half_turns

    !> The smallest 1 - k**2 above zero, 5e-324, takes 13 steps.
    integer, parameter :: most_steps = 16

    !> Bound of a loop that would not end for NaN where a compiler assumes that there is no NaN (-Ofast).
    integer, parameter :: most_means = 64

    !> Where the gap is below this radius, a short series takes the place of all further steps.
    real(wp), parameter :: series_radius = 1.0e-4_wp

    !> The radius for the mean alone, an even function of the gap: the first term left out is 11 c**6/256.
    real(wp), parameter :: mean_radius = 3.0e-3_wp

    !> An angle u below this bound equals its sine, its F and its amplitude to rounding, u**3/6 < eps u/4.
    real(wp), parameter :: small_angle = 1.0e-8_wp

    !> Where y(n)/y(n+1) is above this ratio, rounding makes the angle 0 or pi.
    real(wp), parameter :: largest_ratio = 1.0e20_wp

    !> pi as a sum of two parts. The first has 30 bits: its product with a count below 2**23 is exact.
    real(wp), parameter :: pi_high = 3.1415926516056060791015625_wp
    real(wp), parameter :: pi_low = 1.9841871593610808832795e-9_wp

    !> The sequence from 1 and sqrt(kc2), up to the step N where the series take over.
    type :: agm_sequence
        integer :: steps = 0                  !! N
        real(wp) :: mean = 1.0_wp             !! the limit of a(n)
        real(wp) :: power = 1.0_wp            !! 2**N
        real(wp) :: top = 1.0_wp              !! 2**N a(N)
        real(wp) :: gap = 0.0_wp              !! c = (a(N) - b(N))/(a(N) + b(N)) <= `series_radius`
        real(wp) :: product(0:most_steps)     !! 4**n a(n) b(n), n = 0..N-1
        real(wp) :: square(0:most_steps)      !! 4**n b(n)**2, n = 0..N
    end type agm_sequence

contains

    !> Complete integral of the first kind K(k) = F(pi/2, k).
    !> Domain: |k| <= 1 (or 0 <= kc2 <= 1), outside: NaN. At k = 1: +Infinity.
    !> Accuracy: 4 epsilon, relative; checked by agm: complete-integral-agrees-with-table.
    !> Source: (19) with phi = pi/2; A&S 17.6.3.
    elemental function ellip_k(k, kc2) result(value)
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp) :: value
        real(wp) :: complement, a, b, next
        integer :: n

        complement = modulus_complement(k, kc2)
        if (complement < 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (complement <= 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_positive_inf)
        else
            a = 1.0_wp
            b = sqrt(complement)
            do n = 1, most_means
                if (abs(a - b) <= mean_radius*(a + b)) exit
                next = 0.5_wp*(a + b)
                b = sqrt(a*b)
                a = next
            end do
            value = half_pi/mean_of(a, b, (a - b)/(a + b))
        end if
    end function ellip_k

    !> Integral of the first kind F(phi, k) = int_0^phi dtheta/sqrt(1 - k**2 sin(theta)**2), (21).
    !> Domain: any finite phi, |k| <= 1 (or 0 <= kc2 <= 1), outside: NaN. At k = 1: the inverse Gudermannian
    !> within +-pi/2, +-Infinity beyond. A result beyond the largest number is +-Infinity too.
    !> Accuracy: 6 epsilon, relative, times the change that half an ulp of phi makes where that is larger;
    !> checked by agm: incomplete-integral-agrees-with-table.
    !> Source: (17)-(19).
    elemental function ellip_f(phi, k, kc2) result(value)
        real(wp), intent(in) :: phi                !! amplitude [rad]
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp) :: value
        type(agm_sequence) :: agm
        real(wp) :: complement, turns, remainder

        complement = modulus_complement(k, kc2)
        if (complement < 0.0_wp .or. .not. ieee_is_finite(phi)) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (abs(phi) < small_angle) then
            value = phi
        else if (complement <= 0.0_wp) then
            if (abs(phi) <= half_pi) then
                value = asinh(tan(phi))
            else
                value = sign(ieee_value(1.0_wp, ieee_positive_inf), phi)
            end if
        else
            call half_turns(phi, turns, remainder)
            call start_agm(complement, agm)
            if (1.0e-10_wp*abs(phi) < agm%mean*(1.0e-10_wp*huge(1.0_wp)/2)) then
                value = (turns*pi + scaled_angle(sin(remainder), cos(remainder), agm)/agm%power)/agm%mean
            else
                value = sign(ieee_value(1.0_wp, ieee_positive_inf), phi)
            end if
        end if
    end function ellip_f

    !> Amplitude am(u, k), the inverse of F(phi, k) in phi; continuous and increasing in u.
    !> Domain: any finite u, |k| <= 1 (or 0 <= kc2 <= 1), outside: NaN. At k = 1: the Gudermannian.
    !> Accuracy: 4 epsilon (|am| + |u| dn); checked by agm: amplitude-agrees-with-table.
    elemental function jacobi_am(u, k, kc2) result(phi)
        real(wp), intent(in) :: u                  !! argument
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp) :: phi
        real(wp) :: complement, sn, cn, dn

        complement = modulus_complement(k, kc2)
        if (complement < 0.0_wp .or. .not. ieee_is_finite(u)) then
            phi = ieee_value(1.0_wp, ieee_quiet_nan)
        else
            call functions_at(u, complement, sn, cn, dn, phi)
        end if
    end function jacobi_am

    !> Jacobi elliptic functions sn, cn, dn of u, any u.
    !> Domain: any finite u, |k| <= 1 (or 0 <= kc2 <= 1), outside: NaN. At k = 1: tanh, sech, sech.
    !> Accuracy: 4 epsilon (1 + |u| times the derivative); cn and dn keep relative accuracy as k tends to 1
    !> and u grows. Checked by agm: jacobi-functions-agree-with-table.
    elemental subroutine jacobi(u, k, sn, cn, dn, kc2)
        real(wp), intent(in) :: u                  !! argument
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(out) :: sn, cn, dn        !! sin(am u), cos(am u), sqrt(1 - k**2 sn**2)
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp) :: complement

        complement = modulus_complement(k, kc2)
        if (complement < 0.0_wp .or. .not. ieee_is_finite(u)) then
            sn = ieee_value(1.0_wp, ieee_quiet_nan)
            cn = sn
            dn = sn
        else
            call functions_at(u, complement, sn, cn, dn)
        end if
    end subroutine jacobi

    !> The momentum step of section 3.2 (EgellipX_step): from sn and cn at u0 to sn, cn, dn at u0 + du.
    !> The amplitudes come back too, phi0 = am(u0) in [-pi, pi] and phi1 = am(u0 + du). They are continuous:
    !> phi1 - phi0 counts the turns. Both transformations, up from phi0 and down to phi1, use one sequence.
    !> sn0**2 + cn0**2 may differ from one: only the angle of (cn0, sn0) is used, and (0, 0) has the angle 0.
    !> At k = 1 the motion tends to sn = +-1: cn keeps the sign of cn0, and from cn0 = 0 nothing moves.
    !> Domain: |k| <= 1 (or 0 <= kc2 <= 1), all arguments finite, |sn0|, |cn0| <= 1e100; outside: NaN.
    !> Accuracy: that of `jacobi` at u0 + du; checked by agm: momentum-step-agrees-with-jacobi.
    pure subroutine landen_step(sn0, cn0, du, k, sn, cn, dn, phi0, phi1, kc2)
        real(wp), intent(in) :: sn0, cn0           !! sn and cn at the start
        real(wp), intent(in) :: du                 !! change of the argument, lambda h
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(out) :: sn, cn, dn        !! at the end
        real(wp), intent(out) :: phi0, phi1        !! amplitudes at start and end [rad]
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        type(agm_sequence) :: agm
        real(wp) :: complement
        logical :: valid

        complement = modulus_complement(k, kc2)
        valid = complement >= 0.0_wp .and. all(ieee_is_finite([sn0, cn0, du]))
        if (valid) valid = max(abs(sn0), abs(cn0)) <= 1.0e100_wp
        if (.not. valid) then
            sn = ieee_value(1.0_wp, ieee_quiet_nan)
            cn = sn
            dn = sn
            phi0 = sn
            phi1 = sn
        else
            phi0 = atan2(sn0, cn0)
            if (complement > 0.0_wp) then
                call start_agm(complement, agm)
                call descend(scaled_angle(sn0, cn0, agm)/agm%power, du, agm, sn, cn, dn, phi1)
            else
                call separatrix_step(sn0, cn0, du, sn, cn, phi1)
                dn = abs(cn)
            end if
        end if
    end subroutine landen_step

    !> phi = turns pi + remainder with a whole number of turns and |remainder| <= pi/2.
    !> The double next to pi/2 is below pi/2: its number of turns is 0.
    !> Beyond 2**23 turns the reduction inside the intrinsic `tan` is used.
    elemental subroutine half_turns(phi, turns, remainder)
        real(wp), intent(in) :: phi                !! angle [rad]
        real(wp), intent(out) :: turns             !! a whole number, real as it may exceed any integer kind
        real(wp), intent(out) :: remainder         !! [rad]

        if (abs(phi) <= half_pi) then
            turns = 0.0_wp
            remainder = phi
        else
            turns = anint(phi*(1/pi))
            if (abs(turns) < 2.0_wp**23) then
                remainder = (phi - turns*pi_high) - turns*pi_low
            else
                remainder = atan(tan(phi))
                turns = anint((phi - remainder)/pi)
            end if
        end if
    end subroutine half_turns

    ! ------------------------------------------------------------------------------------------ inner parts

    !> The sequence for 1 - k**2 = kc2 > 0, to the step where the series take over.
    pure subroutine start_agm(kc2, agm)
        real(wp), intent(in) :: kc2
        type(agm_sequence), intent(out) :: agm
        real(wp) :: a, b, ab, power
        integer :: n

        a = 1.0_wp
        b = sqrt(kc2)
        power = 1.0_wp
        do n = 0, most_steps
            agm%square(n) = (power*b)**2
            if (abs(a - b) <= series_radius*(a + b) .or. n == most_steps) exit
            ab = a*b
            agm%product(n) = (power*power)*ab
            a = 0.5_wp*(a + b)
            b = sqrt(ab)
            power = 2*power
        end do
        agm%steps = n
        agm%power = power
        agm%top = power*a
        agm%gap = (a - b)/(a + b)
        agm%mean = mean_of(a, b, agm%gap)
    end subroutine start_agm

    !> Limit of the sequence from a and b with c = (a - b)/(a + b) small:
    !> (a + b)/2 agm(1, sqrt(1 - c**2)) = (a + b)/2 (1 - c**2/4 - 5 c**4/64 - ..).
    pure function mean_of(a, b, c) result(mean)
        real(wp), intent(in) :: a, b, c
        real(wp) :: mean

        mean = 0.5_wp*(a + b)
        mean = mean - mean*(c*c)*(0.25_wp + (5.0_wp/64)*(c*c))
    end function mean_of

    !> 2**N a F of an angle in [-pi, pi], a the limit of a(n), from the sine and cosine of the angle, which
    !> may have a common factor. All steps (17) above N together are, up to terms in c**4,
    !> phi -> phi - (c/2 + c**3/16) sin(2 phi) + (3 c**2/16) sin(4 phi) - (5 c**3/48) sin(6 phi).
    pure function scaled_angle(sine, cosine, agm) result(angle)
        real(wp), intent(in) :: sine, cosine
        type(agm_sequence), intent(in) :: agm
        real(wp) :: angle
        real(wp) :: y, height, turns, sine2, cosine2, inverse
        integer :: n

        height = abs(sine)
        if (height <= small_angle*abs(cosine)) then
            angle = 0.0_wp
            if (height > 0.0_wp) angle = agm%power*agm%mean*height/abs(cosine)
            if (cosine < 0.0_wp) angle = agm%power*pi - angle
        else
            y = cosine/height
            turns = 0.0_wp
            do n = 0, agm%steps - 1
                if (abs(y) < agm%product(n)*(1/largest_ratio)) y = agm%product(n)*(1/largest_ratio)
                turns = 2*turns
                if (y < 0.0_wp) turns = turns + 1
                y = y - agm%product(n)/y
            end do
            inverse = 1/(y*y + agm%top*agm%top)
            sine2 = 2*y*agm%top*inverse
            cosine2 = (y*y - agm%top*agm%top)*inverse
            angle = atan2(agm%top, y) - agm%gap*sine2*(0.5_wp + agm%gap*(-0.375_wp*cosine2 &
                + agm%gap*(0.375_wp - (5.0_wp/12)*sine2*sine2)))
            angle = turns*pi + angle
        end if
        angle = sign(angle, sine)
    end function scaled_angle

    !> sn, cn, dn and the amplitude at u, for 0 <= kc2 <= 1.
    pure subroutine functions_at(u, kc2, sn, cn, dn, phi)
        real(wp), intent(in) :: u, kc2
        real(wp), intent(out) :: sn, cn, dn
        real(wp), intent(out), optional :: phi
        type(agm_sequence) :: agm

        if (abs(u) < small_angle) then
            sn = u
            cn = 1.0_wp
            dn = 1.0_wp
            if (present(phi)) phi = u
        else if (kc2 > 0.0_wp) then
            call start_agm(kc2, agm)
            call descend(0.0_wp, u, agm, sn, cn, dn, phi)
        else
            call separatrix_step(0.0_wp, 1.0_wp, u, sn, cn, phi)
            dn = cn
        end if
    end subroutine functions_at

    !> From a F = start + a du, a the limit of a(n), down to sn, cn, dn and, if present, the amplitude phi.
    !> All steps above N together are, up to terms in c**4,
    !> phi -> phi + (c/2 + 3 c**3/32) sin(2 phi) + (c**2/16) sin(4 phi) + (c**3/96) sin(6 phi),
    !> a shift of at most 5e-5: two series terms give its sine and cosine. Then y(N) = 2**N a(N) cot(phi).
    pure subroutine descend(start, du, agm, sn, cn, dn, phi)
        real(wp), intent(in) :: start, du
        type(agm_sequence), intent(in) :: agm
        real(wp), intent(out) :: sn, cn, dn
        real(wp), intent(out), optional :: phi
        real(wp) :: angle, turns, remainder, y, w, sine, cosine, sine2, cosine2, shift, sine_shift, &
            one_minus_cosine, larger, sense
        integer :: n, count
        logical :: negative

        call half_turns(start + agm%mean*du, turns, remainder)
        sense = 1 - 2*abs(turns - 2*anint(0.5_wp*turns))   ! (-1)**turns
        angle = agm%power*abs(remainder)
        count = int(angle*(1/pi))
        sine = sin(angle)
        cosine = cos(angle)
        sine2 = 2*sine*cosine
        cosine2 = (cosine - sine)*(cosine + sine)
        shift = agm%gap*sine2*(0.5_wp + agm%gap*(0.125_wp*cosine2 + agm%gap*(0.125_wp &
                - (1.0_wp/24)*sine2*sine2)))
        sine_shift = shift*(1 - shift*shift*(1.0_wp/6))
        one_minus_cosine = 0.5_wp*shift*shift
        y = cosine - (sine*sine_shift + cosine*one_minus_cosine)
        sine = sine + (cosine*sine_shift - sine*one_minus_cosine)
        if (btest(count, 0)) then
            sine = -sine
            y = -y
        end if
        if (sine < 0.0_wp) then   ! angle/pi is nearly a whole number, and rounding chose the wrong count
            sine = -sine
            y = -y
            count = count + merge(-1, 1, y < 0.0_wp)
        end if
        y = agm%top*y/max(sine, 1/largest_ratio)
        w = sqrt(y*y + agm%square(agm%steps))
        do n = agm%steps - 1, 0, -1
            negative = btest(count, 0)
            count = count/2
            larger = 0.5_wp*(w + abs(y))
            if ((y < 0.0_wp) .neqv. negative) larger = agm%product(n)/larger
            y = merge(-larger, larger, negative)
            w = sqrt(y*y + agm%square(n))
        end do
        sn = 1/sqrt(1 + y*y)
        cn = y*sn*sense
        dn = w*sn
        if (present(phi)) phi = turns*pi_high + (turns*pi_low + sign(atan2(1.0_wp, y), remainder))
        sn = sign(sn, remainder)*sense
    end subroutine descend

    !> The step for k = 1: sn = tanh, cn = sech, and the amplitude is the Gudermannian. On the branch cn < 0
    !> the motion is the same, half a turn away.
    pure subroutine separatrix_step(sn0, cn0, du, sn, cn, phi)
        real(wp), intent(in) :: sn0, cn0, du
        real(wp), intent(out) :: sn, cn
        real(wp), intent(out), optional :: phi
        real(wp) :: u, decay

        if (abs(cn0) <= 1.0e-300_wp*abs(sn0)) then   ! at rest, to rounding
            sn = sign(1.0_wp, sn0)
            cn = 0.0_wp
            if (present(phi)) phi = sign(half_pi, sn0)
            return
        end if
        u = du
        if (abs(sn0) > 0.0_wp) u = u + asinh(sn0/cn0)
        decay = exp(-abs(u))
        sn = sign(1.0_wp, cn0)*tanh(u)
        cn = sign(2*decay/(1 + decay*decay), cn0)
        if (present(phi)) then
            phi = atan2(tanh(u), abs(cn))
            if (cn0 < 0.0_wp) phi = phi + sign(pi, sn0)
        end if
    end subroutine separatrix_step

end module frb_agm
