!> How chaotic is this top? The largest Lyapunov exponent, from the derivative of the run by its start:
!> `integrate_tangent` advances a variation, and its growth is summed up. A heavy top without symmetry and a
!> tumbling moon like Hyperion are chaotic; for the free body and the Lagrange top the
!> exponent falls to 0 as log t/t. Rounding decides where a chaotic orbit goes, so two digits are shown.
module frb_chaotic_moon
    use frb, only: wp, body_scene, quat_rotate_back, status_ok
    implicit none
    private

    public :: tumbler, new_orbit

    include 'tumbler_model.inc'

end module frb_chaotic_moon

module frb_chaos
    use frb, only: wp, body_scene, rigid_body, splitting_scheme, integrate_tangent, status_ok
    implicit none
    private

    public :: no_torque, exponents

    type, extends(body_scene) :: no_torque
    contains
        procedure :: torque => none
        procedure :: torque_change => no_change
    end type no_torque

contains

    subroutine none(self, q, t, tau, stat)
        class(no_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        associate (unused => self, unused_q => q, unused_t => t)
        end associate
        tau = 0.0_wp
        stat = status_ok
    end subroutine none

    subroutine no_change(self, q, t, n, change, stat)
        class(no_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t, n(3)
        real(wp), intent(out) :: change(3)
        integer, intent(out) :: stat

        associate (unused => self, unused_q => q, unused_t => t, unused_n => n)
        end associate
        change = 0.0_wp
        stat = status_ok
    end subroutine no_change

    !> log(growth)/t of a variation at the times 100, 1000 and 10 000 steps of h.
    subroutine exponents(name, moments, scene, h, m0, q0)
        character(*), intent(in) :: name
        real(wp), intent(in) :: moments(3), h, m0(3), q0(4)
        class(body_scene), intent(inout) :: scene
        integer, parameter :: few = 10
        real(wp) :: m(3), q(4), phi(6, 6), v(6), growth, t, shown(3)
        integer :: k

        m = m0
        q = q0/norm2(q0)
        v = [1.0_wp, 0.5_wp, 0.25_wp, 0.1_wp, 0.2_wp, 0.3_wp]
        v = v/norm2(v)
        growth = 0.0_wp
        t = 0.0_wp
        do k = 1, 10000/few
            call integrate_tangent(rigid_body(moments), splitting_scheme('srkn11'), scene, h, few, m, q, &
                                   phi, t)
            v = matmul(phi, v)
            growth = growth + log(norm2(v))
            v = v/norm2(v)
            if (k*few == 100) shown(1) = growth/t
            if (k*few == 1000) shown(2) = growth/t
        end do
        shown(3) = growth/t
        print '(a,t25,3f11.2)', name, shown
    end subroutine exponents

end module frb_chaos

program scene12_how_chaotic
    use frb, only: wp, heavy_top
    use frb_chaos, only: no_torque, exponents
    use frb_chaotic_moon, only: tumbler, new_orbit
    implicit none
    real(wp), parameter :: moon_moments(3) = [0.314_wp, 0.474_wp, 0.542_wp], e = 0.1_wp
    real(wp), parameter :: leaning(4) = [0.9_wp, 0.3_wp, 0.2_wp, 0.1_wp]
    type(no_torque) :: free
    type(heavy_top) :: top
    type(tumbler) :: moon

    moon = tumbler(moon_moments, new_orbit(1.0_wp, [1 - e, 0.0_wp, 0.0_wp], &
                                           [0.0_wp, sqrt((1 + e)/(1 - e)), 0.0_wp]))
    print '(a)', 'exponent after steps:           100       1000      10000'
    call exponents('free body', [0.6_wp, 0.8_wp, 1.0_wp], free, 0.1_wp, [0.5_wp, 0.6_wp, -0.4_wp], leaning)
    call exponents('Lagrange top', [1.0_wp, 1.0_wp, 0.5_wp], top, 0.1_wp, [0.1_wp, 0.2_wp, 1.5_wp], leaning)
    top%centre = [0.6_wp, 0.3_wp, 0.7_wp]
    call exponents('heavy top', [1.0_wp, 0.8_wp, 0.5_wp], top, 0.1_wp, [0.8_wp, 0.6_wp, 1.0_wp], leaning)
    call exponents('Hyperion', moon_moments, moon, 0.1_wp, moon_moments*[0.0_wp, 0.1_wp, 1.0_wp], &
                   [0.995_wp, 0.1_wp, 0.0_wp, 0.1_wp])
    call exponents('Hyperion, spun up', moon_moments, moon, 0.02_wp, moon_moments*[0.0_wp, 0.1_wp, 8.0_wp], &
                   [0.995_wp, 0.1_wp, 0.0_wp, 0.1_wp])
end program scene12_how_chaotic

! Output:
!   exponent after steps:           100       1000      10000
!   free body                      0.24       0.05       0.01
!   Lagrange top                   0.16       0.04       0.01
!   heavy top                      0.23       0.13       0.11
!   Hyperion                       0.12       0.11       0.14
!   Hyperion, spun up              0.33       0.11       0.02
