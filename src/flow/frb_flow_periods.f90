!> Whole periods of the elliptic triple, by the arithmetic-geometric mean.
module frb_flow_periods
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: quarter_period, reduce_periods

contains

    !> Quarter period T4 = K(k)/lambda of the triple and the integral H(T4) of the third kind over it, as
    !> H/T4 = mean, in the unit of time of pmax = max(P, R), delta = |R - P| > 0 and nu:
    !> T4 = pi/(2 agm(sqrt(pmax), sqrt(delta))), and from the same sequence
    !> mean = sum_j Q_j/(2 (pmax + nu)), Q_0 = 1, Q_(j+1) = Q_j e_j/2,
    !> e_j = (p_j^2 - a_j g_j)/(p_j^2 + a_j g_j), p_(j+1) = (p_j^2 + a_j g_j)/(2 p_j), p_0^2 = pmax + nu
    !> (DLMF 19.8.7 with alpha^2 = -nu/pmax).
    !> The period is taken from the series of K as soon as a_j and g_j are close, while the sum goes on.
    !> Accuracy: 4 units of 2^-53 relative.
    pure subroutine quarter_period(pmax, delta, nu, with_mean, period, mean)
        real(wp), intent(in) :: pmax, delta, nu
        logical, intent(in) :: with_mean                    !! .false.: the period alone is wanted, mean is 0
        real(wp), intent(out) :: period, mean
        integer, parameter :: most = 20                     ! the mean of 1 and 1e-308 needs 14
        real(wp), parameter :: negligible = 1.0e-17_wp      ! bound of the next term: e_(j+1) < e_j^2
        real(wp), parameter :: close_for_series = 0.25_wp   ! x^26 of the series is then below rounding
        real(wp) :: a, g, p, ag, pp, e, q, sum_q, x2, x4, x8
        logical :: found
        integer :: j

        a = sqrt(pmax)
        g = sqrt(delta)
        p = sqrt(pmax + nu)
        q = 1.0_wp
        sum_q = 1.0_wp
        found = .false.
        period = 0.0_wp
        mean = 0.0_wp
        do j = 1, most
            if (.not. found .and. a - g <= close_for_series*(a + g)) then
                ! agm(1 + x, 1 - x) = pi/(2 K(x)), K(x) = (pi/2) sum ((2n - 1)!!/(2n)!!)^2 x^(2n)
                found = .true.
                x2 = ((a - g)/(a + g))**2
                x4 = x2*x2
                x8 = x4*x4
                period = (pi/(a + g))*((((1 + x2*(1/4.0_wp)) + x4*((3/8.0_wp)**2 + x2*(5/16.0_wp)**2)) &
                                        + x8*(((35/128.0_wp)**2 + x2*(63/256.0_wp)**2) &
                                              + x4*((231/1024.0_wp)**2 + x2*(429/2048.0_wp)**2))) &
                                       + (x8*x8)*((((6435/32768.0_wp)**2 + x2*(12155/65536.0_wp)**2) &
                                                   + x4*((46189/262144.0_wp)**2 &
                                                         + x2*(88179/524288.0_wp)**2)) &
                                                  + x8*(676039/4194304.0_wp)**2))
            end if
            if (found .and. .not. with_mean) return
            ag = a*g
            pp = p*p
            e = (pp - ag)/(pp + ag)
            q = 0.5_wp*q*e
            p = (pp + ag)/(2*p)
            sum_q = sum_q + q
            if (found .and. abs(q)*e*e <= negligible) exit
            a = 0.5_wp*(a + g)
            g = sqrt(ag)
        end do
        mean = sum_q/(2*(pmax + nu))
    end subroutine quarter_period

    !> Takes whole half periods 2 T4 out of the time 1: what is left is `fraction`, |fraction| <= T4;
    !> an odd number of them turns the sign of s and of the cn-like function, `turned` = -1; the integral of
    !> the third kind over what is taken out is `whole`. On the separatrix (delta < 1e-200 pmax) there are no
    !> periods: the motion has settled on the middle axis to all digits after 60 units of 1/lambda, and the
    !> rest is uniform.
    pure subroutine reduce_periods(pmax, delta, nu, with_whole, fraction, turned, whole)
        real(wp), intent(in) :: pmax, delta, nu
        logical, intent(in) :: with_whole       !! .false.: `whole` is not wanted and comes back 0
        real(wp), intent(out) :: fraction, turned, whole
        real(wp), parameter :: most_exact = 2.0_wp**26
        real(wp), parameter :: separatrix = 1.0e-200_wp
        real(wp), parameter :: settled = 60.0_wp
        real(wp), parameter :: round_up = 6755399441055744.0_wp    ! 3 * 2^51: adding it rounds to an integer
        real(wp) :: period, mean, half, number, high

        turned = 1.0_wp
        if (delta <= separatrix*pmax) then
            fraction = min(1.0_wp, settled/sqrt(pmax))
            whole = (1 - fraction)/(pmax + nu)
            return
        end if
        call quarter_period(pmax, delta, nu, with_whole, period, mean)
        half = 2*period
        number = 1/half
        if (number <= most_exact) then
            number = (number + round_up) - round_up
            ! Split half into 27 and 26 bits: number*high is exact, and so is the subtraction that cancels.
            high = half*134217729.0_wp
            high = high - (high - half)
            fraction = (1 - number*high) - number*(half - high)
        else
            fraction = mod(1.0_wp, half)
            number = (1 - fraction)/half
            if (fraction > period) then
                fraction = fraction - half
                number = number + 1
            end if
            number = mod(number, 2.0_wp)
        end if
        turned = 1 - 2*abs(number - 2*((0.5_wp*number + round_up) - round_up))
        whole = (1 - fraction)*mean
    end subroutine reduce_periods

end module frb_flow_periods
