!> Legendre's elliptic integral of the third kind, of any amplitudes.
!>
!>     Pi(phi, n, k) = int_0^phi dtheta / ((1 - n sin(theta)**2) sqrt(1 - k**2 sin(theta)**2))      (22)
!>
!> The sign of n is the paper's, (22): the integral has a pole at sin(theta)**2 = 1/n. The modulus is k.
!> Close to the separatrix 1 - k**2 and 1 - n are small, and better known than k and n. Pass them as kc2 and
!> nc: k is then not used, and n only as the factor of a term, where its rounding does not count.
module frb_legendre
    use frb_agm, only: half_turns
    use frb_carlson, only: rf, rf_and_rj
    use frb_complements, only: modulus_complement, one_minus
    use frb_kinds, only: wp, pi, half_pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: ellpi, ellint_pi, ellint_pi_between

    !> For n below this bound the terms of RF - |n|/3 RJ would cancel, and `pi_of_negative` takes over.
    real(wp), parameter :: lowest_direct = -1.0_wp

    !> For 1 - n beyond the first bound Pi does not depend on k, to rounding. For kc2 below the second bound
    !> only F depends on kc2.
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
        real(wp) :: complement, difference
        logical :: valid

        call check_domain(n, k, kc2, nc, complement, difference, valid)
        if (valid) valid = ieee_is_finite(phi)
        if (valid) valid = abs(phi) <= half_pi
        if (valid) then
            value = pi_of_sine(sin(phi), cos(phi), n, complement, difference)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellpi

    !> Pi(phi2, n, k) - Pi(phi1, n, k), the integral from phi1 to phi2, any amplitudes.
    !> Each half turn adds two complete integrals; the remaining angles add two incomplete ones.
    !> Domain: phi1, phi2 finite, |k| <= 1, n < 1 (or n sin**2 < 1 from phi1 to phi2); outside: NaN.
    !> An integral across pi/2 + j pi at k = 1 or nc = 0 is Infinity with the sign of phi2 - phi1, and so is a
    !> value beyond the largest number.
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
        real(wp) :: complement, difference, turns1, turns2, angle1, angle2
        logical :: valid

        call check_domain(n, k, kc2, nc, complement, difference, valid)
        if (valid) valid = ieee_is_finite(phi1) .and. ieee_is_finite(phi2)
        if (valid) then
            call half_turns(phi1, turns1, angle1)
            call half_turns(phi2, turns2, angle2)
            value = pi_between(turns1, sin(angle1), cos(angle1), turns2, sin(angle2), cos(angle2), &
                               n, complement, difference)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellint_pi

    !> As `ellint_pi`, for amplitudes whose sine and cosine are known, as in a step. The value is formed from
    !> sn and cn, so it is accurate close to multiples of pi/2 too; the amplitudes only count half turns.
    !> Domain and accuracy: as `ellint_pi`, without the error that comes from rounding the amplitudes.
    elemental function ellint_pi_between(phi1, sn1, cn1, phi2, sn2, cn2, n, k, kc2, nc) result(value)
        real(wp), intent(in) :: phi1, sn1, cn1     !! amplitude at the start [rad], its sine and cosine
        real(wp), intent(in) :: phi2, sn2, cn2     !! amplitude at the end [rad], its sine and cosine
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2
        real(wp), intent(in), optional :: nc       !! 1 - n
        real(wp) :: value
        logical :: valid
        real(wp) :: complement, difference

        call check_domain(n, k, kc2, nc, complement, difference, valid)
        if (valid) valid = all(ieee_is_finite([phi1, sn1, cn1, phi2, sn2, cn2]))
        if (valid) then
            value = pi_between(counted_turns(phi1, cn1), sign(1.0_wp, cn1)*sn1, abs(cn1), &
                               counted_turns(phi2, cn2), sign(1.0_wp, cn2)*sn2, abs(cn2), n, &
                               complement, difference)
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function ellint_pi_between

    ! ------------------------------------------------------------------------------------------ inner parts

    !> 1 - k**2 and 1 - n, and whether both and n are finite and |k| <= 1.
    pure subroutine check_domain(n, k, kc2, nc, complement, difference, valid)
        real(wp), intent(in) :: n, k
        real(wp), intent(in), optional :: kc2, nc
        real(wp), intent(out) :: complement   !! 1 - k**2
        real(wp), intent(out) :: difference   !! 1 - n
        logical, intent(out) :: valid

        complement = modulus_complement(k, kc2)
        difference = one_minus(n, nc)
        valid = complement >= 0.0_wp .and. ieee_is_finite(n) .and. ieee_is_finite(difference)
    end subroutine check_domain

    !> Number of half turns of phi: odd exactly if the cosine is negative, also close to pi/2 + j pi.
    pure function counted_turns(phi, cosine) result(turns)
        real(wp), intent(in) :: phi, cosine
        real(wp) :: turns
        logical :: odd

        turns = anint(phi*(1/pi))
        odd = abs(turns - 2*anint(0.5_wp*turns)) > 0.5_wp
        if (odd .neqv. sign(1.0_wp, cosine) < 0.0_wp) turns = turns + sign(1.0_wp, phi - turns*pi)
    end function counted_turns

    !> Pi(phi2) - Pi(phi1) for amplitudes phi = turns pi + angle, |angle| <= pi/2, s and c the sine and cosine
    !> of the angle.
    pure function pi_between(turns1, s1, c1, turns2, s2, c2, n, kc2, nc) result(value)
        real(wp), intent(in) :: turns1, s1, c1, turns2, s2, c2, n, kc2, nc
        real(wp) :: value
        real(wp) :: turns, complete

        turns = turns2 - turns1
        value = 0.0_wp
        if (abs(turns) > 0.5_wp) then
            complete = pi_of_sine(1.0_wp, 0.0_wp, n, kc2, nc)
            if (.not. ieee_is_finite(complete)) then   ! NaN, or infinite between phi1 and phi2
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

    !> Pi for the amplitude in [-pi/2, pi/2] with sine s and cosine c, with p = 1 - n s**2:
    !> s RF(c**2, 1 - k**2 s**2, 1) + n/3 s**3 RJ(c**2, 1 - k**2 s**2, 1, p) (DLMF 19.25.14).
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
        else if (n >= lowest_direct) then
            call rf_and_rj(cc, dd, 1.0_wp, p, first, third)
            value = s*(first + (n*(1.0_wp/3))*ss*third)
        else
            value = pi_of_negative(s, c, n, kc2, nc)
        end if
    end function pi_of_sine

    !> Pi for n < -1, as a sum of three terms of one sign. With N = (k**2 - n)/(1 - n), which lies between
    !> k**2 and 1, and 1 - N = kc2/nc (A&S 17.7.15-17):
    !>
    !>     Pi(n) = -n kc2/(nc (k**2 - n)) Pi(N) + k**2/(k**2 - n) F
    !>             + sqrt(-n/(nc (k**2 - n))) atan(sqrt(-n (k**2 - n)/nc) s c/sqrt(1 - k**2 s**2)).
    !>
    !> As kc2 tends to 0, the first term and the arctangent together no longer depend on kc2, while kc2/nc
    !> could underflow: in these two terms kc2 is at least `smallest_complement`.
    pure function pi_of_negative(s, c, n, kc2, nc) result(value)
        real(wp), intent(in) :: s, c, n, kc2, nc
        real(wp) :: value
        real(wp) :: ss, cc, dd, first, third, k2, k2_minus_n, floored

        if (nc > largest_divisor) then
            value = atan2(sqrt(nc)*s, c)/sqrt(nc)   ! to a relative k**2 F/sqrt(nc), F < 400
            return
        end if
        ss = s*s
        cc = c*c
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
