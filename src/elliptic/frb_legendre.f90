!> Legendre's elliptic integral of the third kind, of any amplitudes.
!>
!>     Pi(phi, n, k) = int_0^phi dtheta / ((1 - n sin(theta)**2) sqrt(1 - k**2 sin(theta)**2))      (22)
!>
!> The sign of n is the paper's, (22): the integral has a pole at sin(theta)**2 = 1/n. The modulus is k.
!> Where 1 - k**2 or 1 - n is known better than k or n (close to the separatrix both are small), pass kc2 or
!> nc; k or n is then used only where it does no harm.
module frb_legendre
    use frb_agm, only: half_turns
    use frb_carlson, only: rf, rf_and_rj
    use frb_kinds, only: wp, pi, half_pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: ellpi, ellint_pi, ellint_pi_between

    !> Below -1 the terms of RF - |n|/3 RJ would cancel; n is then taken to (k**2 - n)/(1 - n), in (k**2, 1).
    real(wp), parameter :: lowest_plain = -1.0_wp

    !> Beyond this 1 - n the integral is that of k = 0 to rounding; below this kc2 it enters through F alone.
    real(wp), parameter :: largest_divisor = 1.0e40_wp, smallest_complement = 1.0e-250_wp

contains

    !> Pi(phi, n, k) for |phi| <= pi/2, by Carlson's RF and RJ.
    !> Domain: |phi| <= pi/2, |k| <= 1, n < 1 or n sin(phi)**2 < 1, all finite; outside: NaN.
    !> At phi = pi/2 with kc2 = 0 or nc = 0 given: Infinity.
    !> Accuracy: 8 epsilon, relative, times the change that half an ulp of phi makes where that is larger;
    !> checked by legendre: pi-agrees-with-table.
    !> Source: DLMF 19.25.14; for n < -1 with A&S 17.7.15-17 (n taken to (k**2 - n)/(1 - n)).
    elemental function ellpi(phi, n, k, kc2, nc) result(value)
        real(wp), intent(in) :: phi                !! amplitude [rad]
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2
        real(wp), intent(in), optional :: nc       !! 1 - n
        real(wp) :: value
        real(wp) :: complement, rest
        logical :: valid

        call complements_of(n, k, kc2, nc, complement, rest, valid)
        if (valid) valid = ieee_is_finite(phi)
        if (valid) valid = abs(phi) <= half_pi
        if (valid) then
            value = pi_of_sine(sin(phi), cos(phi), n, complement, rest)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellpi

    !> Pi(phi2, n, k) - Pi(phi1, n, k), the integral from phi1 to phi2, any amplitudes.
    !> Whole half turns are counted by the complete integral, the rest is a difference of two incomplete ones.
    !> Domain: phi1, phi2 finite, |k| <= 1, n < 1 (or n sin**2 < 1 on the whole way); outside: NaN.
    !> An integral across pi/2 + j pi at k = 1 or nc = 0, or one beyond the largest number, is Infinity with
    !> the sign of phi2 - phi1.
    !> Accuracy: 8 epsilon (|Pi(phi1)| + |Pi(phi2)|), and the change that half an ulp of the amplitudes makes;
    !> checked by legendre: difference-of-any-amplitudes-agrees-with-table.
    !> Source: section 3.4 (`ellint_pi`).
    elemental function ellint_pi(phi1, phi2, n, k, kc2, nc) result(value)
        real(wp), intent(in) :: phi1, phi2         !! amplitudes at start and end [rad]
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2
        real(wp), intent(in), optional :: nc       !! 1 - n
        real(wp) :: value
        real(wp) :: complement, rest, turns1, turns2, rest1, rest2
        logical :: valid

        call complements_of(n, k, kc2, nc, complement, rest, valid)
        if (valid) valid = ieee_is_finite(phi1) .and. ieee_is_finite(phi2)
        if (valid) then
            call half_turns(phi1, turns1, rest1)
            call half_turns(phi2, turns2, rest2)
            value = pi_between(turns1, sin(rest1), cos(rest1), turns2, sin(rest2), cos(rest2), &
                               n, complement, rest)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellint_pi

    !> As `ellint_pi`, for amplitudes whose sine and cosine are known, as they are in a step: sn and cn carry
    !> the accuracy close to multiples of pi/2, the amplitudes serve to count the half turns only.
    !> Domain and accuracy: as `ellint_pi`, without the part that comes from rounding the amplitudes.
    elemental function ellint_pi_between(phi1, sn1, cn1, phi2, sn2, cn2, n, k, kc2, nc) result(value)
        real(wp), intent(in) :: phi1, sn1, cn1     !! amplitude at the start [rad], its sine and cosine
        real(wp), intent(in) :: phi2, sn2, cn2     !! amplitude at the end [rad], its sine and cosine
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2
        real(wp), intent(in), optional :: nc       !! 1 - n
        real(wp) :: value
        real(wp) :: complement, rest
        logical :: valid

        call complements_of(n, k, kc2, nc, complement, rest, valid)
        if (valid) valid = ieee_is_finite(phi1) .and. ieee_is_finite(phi2)
        if (valid) valid = ieee_is_finite(sn1) .and. ieee_is_finite(cn1) .and. ieee_is_finite(sn2) &
            .and. ieee_is_finite(cn2)
        if (valid) then
            value = pi_between(counted_turns(phi1, cn1), sign(1.0_wp, cn1)*sn1, abs(cn1), &
                               counted_turns(phi2, cn2), sign(1.0_wp, cn2)*sn2, abs(cn2), n, complement, rest)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellint_pi_between

    ! ------------------------------------------------------------------------------------------ inner parts

    !> 1 - k**2 and 1 - n from the arguments, and whether they are in the domain.
    pure subroutine complements_of(n, k, kc2, nc, complement, rest, valid)
        real(wp), intent(in) :: n, k
        real(wp), intent(in), optional :: kc2, nc
        real(wp), intent(out) :: complement   !! 1 - k**2
        real(wp), intent(out) :: rest         !! 1 - n
        logical, intent(out) :: valid

        complement = 1.0_wp
        rest = 1.0_wp
        valid = ieee_is_finite(n)
        if (valid) rest = 1 - n
        if (present(nc)) then
            if (valid) valid = ieee_is_finite(nc)
            if (valid) rest = nc
        end if
        if (present(kc2)) then
            if (valid) valid = ieee_is_finite(kc2)
            if (valid) valid = kc2 >= 0.0_wp .and. kc2 <= 1.0_wp
            if (valid) complement = kc2
        else
            if (valid) valid = ieee_is_finite(k)
            if (valid) valid = abs(k) <= 1.0_wp
            if (valid) complement = (1 - k)*(1 + k)
        end if
    end subroutine complements_of

    !> Number of half turns of phi, made to agree with the sign of the cosine close to pi/2 + j pi.
    pure function counted_turns(phi, cosine) result(turns)
        real(wp), intent(in) :: phi, cosine
        real(wp) :: turns
        logical :: odd

        turns = anint(phi*(1/pi))
        odd = abs(turns - 2*anint(0.5_wp*turns)) > 0.5_wp
        if (odd .neqv. sign(1.0_wp, cosine) < 0.0_wp) turns = turns + sign(1.0_wp, phi - turns*pi)
    end function counted_turns

    !> The difference for amplitudes in half turns and rest, the rest by sine and cosine.
    pure function pi_between(turns1, s1, c1, turns2, s2, c2, n, kc2, nc) result(value)
        real(wp), intent(in) :: turns1, s1, c1, turns2, s2, c2, n, kc2, nc
        real(wp) :: value
        real(wp) :: turns, complete

        turns = turns2 - turns1
        value = 0.0_wp
        if (abs(turns) > 0.5_wp) then
            complete = pi_of_sine(1.0_wp, 0.0_wp, n, kc2, nc)
            if (.not. ieee_is_finite(complete)) then   ! NaN, or an infinite integral in the middle of the way
                value = complete
                if (complement_vanishes(kc2, nc)) value = sign(complete, turns)
                return
            end if
            if (exponent(turns) + exponent(complete) >= maxexponent(1.0_wp) - 2) then
                value = sign(ieee_value(1.0_wp, ieee_positive_inf), turns)
                return
            end if
            value = turns*(2*complete)
        end if
        value = value + (pi_of_sine(s2, c2, n, kc2, nc) - pi_of_sine(s1, c1, n, kc2, nc))
    end function pi_between

    !> Whether the complete integral is infinite.
    pure function complement_vanishes(kc2, nc) result(vanishes)
        real(wp), intent(in) :: kc2, nc
        logical :: vanishes

        vanishes = nc >= 0.0_wp .and. min(kc2, nc) <= 0.0_wp
    end function complement_vanishes

    !> Pi for the amplitude in [-pi/2, pi/2] with sine s and cosine c.
    pure function pi_of_sine(s, c, n, kc2, nc) result(value)
        real(wp), intent(in) :: s, c, n, kc2, nc
        real(wp) :: value
        real(wp) :: ss, cc, dd, first, third, p

        ss = s*s
        cc = c*c
        dd = cc + kc2*ss
        p = cc + nc*ss
        if (p < 0.0_wp) then
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        else if (p <= 0.0_wp .or. (cc <= 0.0_wp .and. dd <= 0.0_wp)) then
            value = sign(ieee_value(1.0_wp, ieee_positive_inf), s)
        else if (n >= lowest_plain) then
            call rf_and_rj(cc, dd, 1.0_wp, p, first, third)
            value = s*(first + (n*(1.0_wp/3))*ss*third)
        else
            value = pi_of_negative(s, c, n, kc2, nc)
        end if
    end function pi_of_sine

    !> Pi for n < -1, from the one with N = (k**2 - n)/(1 - n), 1 - N = kc2/nc: three terms of one sign,
    !> -n kc2/(nc (k**2 - n)) Pi(N) + k**2/(k**2 - n) F + sqrt(-n/(nc (k**2 - n))) atan(..).
    pure function pi_of_negative(s, c, n, kc2, nc) result(value)
        real(wp), intent(in) :: s, c, n, kc2, nc
        real(wp) :: value
        real(wp) :: ss, cc, dd, first, third, k2, k2_minus_n, floored

        ss = s*s
        cc = c*c
        if (nc > largest_divisor) then
            value = atan2(sqrt(nc)*s, c)/sqrt(nc)   ! but for a relative k**2 F/sqrt(nc), F < 400
            return
        end if
        ! the first and the third term together forget kc2 as it goes to 0; so kc2/nc need not underflow
        floored = max(kc2, smallest_complement)
        dd = cc + floored*ss
        call rf_and_rj(cc, dd, 1.0_wp, cc + (floored/nc)*ss, first, third)
        k2 = 1 - floored
        k2_minus_n = k2 - n
        value = (-n/k2_minus_n)*(floored/nc)*s*(first + (k2_minus_n/nc*(1.0_wp/3))*ss*third) &
            + atan2(sqrt(-n/nc)*sqrt(k2_minus_n)*s*c, sqrt(dd))*sqrt(-n/k2_minus_n)/sqrt(nc)
        if (kc2 < floored) first = rf(cc, cc + kc2*ss, 1.0_wp)
        value = value + (k2/k2_minus_n)*s*first
    end function pi_of_negative

end module frb_legendre
