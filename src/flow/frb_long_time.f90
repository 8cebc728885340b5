!> Whole periods. pm, dl, nu in units of t^-2 (already times t^2), time is 1.
module frb_long_time
    use frb_kinds, only: wp, pi
    implicit none
    private
    public :: long_triple
contains
    pure subroutine long_triple(pm, dl, nu, rest, parity, whole)
        real(wp), intent(in) :: pm, dl, nu
        real(wp), intent(out) :: rest, whole
        integer, intent(out) :: parity
        real(wp) :: a, g, p, q, qs, e, t2, n
        integer :: k
        parity = 0
        whole = 0
        rest = 1
        if (dl <= 0) return
        a = sqrt(pm)
        g = sqrt(dl)
        p = sqrt(pm + nu)
        q = 1
        qs = 1
        do k = 1, 12
            e = (p*p - a*g)/(p*p + a*g)
            p = (p*p + a*g)/(2*p)
            q = 0.5_wp*q*e
            qs = qs + q
            e = a
            a = (a + g)/2
            if (abs(e - g) < 1.0e-8_wp*a) exit
            g = sqrt(e*g)
        end do
        t2 = pi/a   ! 2 T4
        n = anint(1/t2)
        rest = 1 - n*t2
        parity = int(mod(n, 2.0_wp))
        whole = n*t2*qs/(2*(pm + nu))
    end subroutine long_triple
end module frb_long_time
