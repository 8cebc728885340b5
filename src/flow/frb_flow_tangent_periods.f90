!> Many periods in one step: the time that remains without whole periods, and the integrals of the step and of
!> its derivative over the periods.
module frb_flow_tangent_periods
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: reduce_periods

contains

    !> As in frb_flow_long, with the integrals D and `own` over the periods that are removed.
    pure subroutine reduce_periods(pmax, delta, nu, with_third, fraction, turned, whole_third, whole_dd, &
                                   whole_own)
        real(wp), intent(in) :: pmax, delta, nu
        logical, intent(in) :: with_third       !! .false.: whole_third is not wanted, and means nothing
        real(wp), intent(out) :: fraction, turned, whole_third, whole_dd, whole_own
        real(wp) :: period, mean_third, mean_dd, mean_own

        call quarter_means(pmax, delta, nu, with_third, period, mean_third, mean_dd, mean_own)
        call remove_periods(period, fraction, turned)
        whole_third = (1 - fraction)*mean_third
        whole_dd = (1 - fraction)*mean_dd
        whole_own = (1 - fraction)*mean_own
    end subroutine reduce_periods

    !> The quarter period and the means over it of s^2/(1 + nu s^2), s^2 and s^2/dn^2: the sum of
    !> quarter_period with p_0^2 = pmax + nu, pmax and delta, for one sequence a_j, g_j.
    pure subroutine quarter_means(pmax, delta, nu, with_third, period, mean_third, mean_dd, mean_own)
        real(wp), intent(in) :: pmax, delta, nu
        logical, intent(in) :: with_third
        real(wp), intent(out) :: period, mean_third, mean_dd, mean_own
        integer, parameter :: most = 20
        real(wp), parameter :: negligible = 1.0e-17_wp, close = 1.0e-9_wp
        real(wp) :: a, g, ag, p1, p2, p3, q1, q2, q3, e1, e2, e3
        integer :: j

        a = sqrt(pmax)
        g = sqrt(delta)
        p1 = sqrt(pmax + nu)
        p2 = a
        p3 = g
        q1 = 1.0_wp
        q2 = 1.0_wp
        q3 = 1.0_wp
        mean_third = 1.0_wp
        mean_dd = 1.0_wp
        mean_own = 1.0_wp
        e1 = 0.0_wp
        do j = 1, most
            ag = a*g
            if (with_third) call next_term(ag, p1, q1, e1, mean_third)
            call next_term(ag, p2, q2, e2, mean_dd)
            call next_term(ag, p3, q3, e3, mean_own)
            a = 0.5_wp*(a + g)
            g = sqrt(ag)
            if (max(abs(q1)*e1*e1, abs(q2)*e2*e2, abs(q3)*e3*e3) <= negligible &
                .and. abs(a - g) <= close*a) exit
        end do
        period = pi/(a + g)
        mean_third = mean_third/(2*(pmax + nu))
        mean_dd = mean_dd/(2*pmax)
        mean_own = mean_own/(2*delta)
    end subroutine quarter_means

    !> e = (p^2 - ag)/(p^2 + ag), q <- q e/2, p <- (p^2 + ag)/(2 p), sum <- sum + q.
    pure subroutine next_term(ag, p, q, e, sum)
        real(wp), intent(in) :: ag
        real(wp), intent(inout) :: p, q, sum
        real(wp), intent(out) :: e
        real(wp) :: pp

        pp = p*p
        e = (pp - ag)/(pp + ag)
        q = 0.5_wp*q*e
        p = (pp + ag)/(2*p)
        sum = sum + q
    end subroutine next_term

    include 'whole_periods.inc'

end module frb_flow_tangent_periods
