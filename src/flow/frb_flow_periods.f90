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
    !> mean = sum_j Q_j/(2 (pmax + nu)), Q_0 = 1, Q_(j+1) = Q_j e_j/2, e_j = (p_j^2 - a_j g_j)/(p_j^2 + a_j g_j),
    !> p_(j+1) = (p_j^2 + a_j g_j)/(2 p_j), p_0^2 = pmax + nu (DLMF 19.8.7 with alpha^2 = -nu/pmax).
    !> Accuracy: 4 units of 2^-53 relative.
    pure subroutine quarter_period(pmax, delta, nu, period, mean)
        real(wp), intent(in) :: pmax, delta, nu
        real(wp), intent(out) :: period, mean
        integer, parameter :: most = 20                     ! the mean of 1 and 1e-308 needs 14
        real(wp), parameter :: close_enough = 1.0e-8_wp     ! the next mean is then right to rounding
        real(wp) :: a, g, p, ag, pp, q, sum_q, next
        integer :: j

        a = sqrt(pmax)
        g = sqrt(delta)
        p = sqrt(pmax + nu)
        q = 1.0_wp
        sum_q = 1.0_wp
        do j = 1, most
            ag = a*g
            pp = p*p
            q = 0.5_wp*q*((pp - ag)/(pp + ag))
            p = (pp + ag)/(2*p)
            sum_q = sum_q + q
            next = 0.5_wp*(a + g)
            if (abs(a - g) <= close_enough*a) exit
            g = sqrt(ag)
            a = next
        end do
        period = pi/(2*next)
        mean = sum_q/(2*(pmax + nu))
    end subroutine quarter_period

    !> Takes whole half periods 2 T4 out of the time 1: what is left is `fraction`, |fraction| <= T4; an odd
    !> number of them turns the sign of s and of the cn-like function; the integral of the third kind over
    !> what is taken out is `whole`. On the separatrix (delta < 1e-200 pmax) there are no periods: the motion has
    !> settled on the middle axis to all digits after 60 units of 1/lambda, and the rest is uniform.
    pure subroutine reduce_periods(pmax, delta, nu, fraction, odd, whole)
        real(wp), intent(in) :: pmax, delta, nu
        real(wp), intent(out) :: fraction
        logical, intent(out) :: odd
        real(wp), intent(out) :: whole
        real(wp), parameter :: most_exact = 2.0_wp**26
        real(wp), parameter :: separatrix = 1.0e-200_wp
        real(wp), parameter :: settled = 60.0_wp
        real(wp), parameter :: round_up = 6755399441055744.0_wp    ! 3 * 2^51: adding it rounds to an integer
        real(wp) :: period, mean, half, number, high

        fraction = 1.0_wp
        whole = 0.0_wp
        odd = .false.
        if (delta <= separatrix*pmax) then
            fraction = min(1.0_wp, settled/sqrt(pmax))
            whole = (1 - fraction)/(pmax + nu)
            return
        end if
        call quarter_period(pmax, delta, nu, period, mean)
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
        odd = abs(number - 2*((0.5_wp*number + round_up) - round_up)) > 0.5_wp
        whole = (1 - fraction)*mean
    end subroutine reduce_periods

end module frb_flow_periods
