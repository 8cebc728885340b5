!> An ellipsoid of 200 m by 160 m by 120 m on an orbit about a sphere of 0.8 km: a moon of an asteroid. Both
!> pull each other, gravity to second degree in size over distance: with x from sphere to ellipsoid and
!> u = x/r, V = -G M m/r - G M (tr I - 3 u . I u)/(2 r^3). A loop written by a user, with x, p, m, q: the sum
!> of the angular momenta of orbit and spin is kept to rounding, the energy to the error of the scheme. No
!> tides. Lengths in km, times in h, masses in 1e12 kg.
module frb_pair
    use frb, only: wp, quat_rotate, quat_rotate_back
    implicit none
    private

    public :: pull, reduced_mass, rate, moments, cross

    real(wp), parameter :: gravity = 0.864989_wp            ! km^3/(1e12 kg h^2)
    real(wp), parameter :: sphere = 0.54_wp, ellipsoid = 0.0048_wp
    real(wp), parameter :: reduced_mass = sphere*ellipsoid/(sphere + ellipsoid)
    real(wp), parameter :: axes(3) = [0.1_wp, 0.08_wp, 0.06_wp]
    real(wp), parameter :: moments(3) = ellipsoid/5*(sum(axes**2) - axes**2)

contains

    !> Mean motion of an orbit of the given half axis.
    pure function rate(half_axis) result(n)
        real(wp), intent(in) :: half_axis
        real(wp) :: n

        n = sqrt(gravity*(sphere + ellipsoid)/half_axis**3)
    end function rate

    !> Force on the ellipsoid in space, torque on it in its axes, potential.
    pure subroutine pull(x, q, f, tau, v)
        real(wp), intent(in) :: x(3), q(4)
        real(wp), intent(out) :: f(3), tau(3), v
        real(wp) :: r, u(3), iu(3), uiu, gm

        r = norm2(x)
        u = quat_rotate_back(q, x/r)
        iu = moments*u
        uiu = dot_product(u, iu)
        gm = gravity*sphere
        v = -gm*ellipsoid/r - gm*(sum(moments) - 3*uiu)/(2*r**3)
        f = -gm*ellipsoid/r**2*u - 1.5_wp*gm/r**4*((sum(moments) - 5*uiu)*u + 2*iu)
        f = quat_rotate(q, f)
        tau = 3*gm/r**3*cross(u, iu)
    end subroutine pull

    pure function cross(u, v) result(w)
        real(wp), intent(in) :: u(3), v(3)
        real(wp) :: w(3)

        w = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
    end function cross

end module frb_pair

program scene9_two_bodies
    use frb, only: wp, rigid_body, free_flow, kinetic_energy, quat_rotate, splitting_plan, splitting_scheme
    use frb_pair, only: pull, reduced_mass, rate, moments, cross
    implicit none
    real(wp), parameter :: half_axis = 1.2_wp, eccentricity = 0.05_wp
    integer, parameter :: per_orbit = 40
    type(splitting_plan) :: plan
    type(rigid_body) :: body
    real(wp) :: x(3), p(3), m(3), q(4), f(3), tau(3), v, n, h, energy, start_energy, momentum(3), start(3)
    integer :: step, i

    body = rigid_body(moments)
    n = rate(half_axis)
    h = 2*acos(-1.0_wp)/n/per_orbit
    plan = splitting_plan(splitting_scheme('srkn6'), h)
    ! At the pericentre, one turn an orbit, the long axis 0.3 rad off the line to the sphere and tilted.
    x = [half_axis*(1 - eccentricity), 0.0_wp, 0.0_wp]
    p = [0.0_wp, reduced_mass*n*half_axis*sqrt((1 + eccentricity)/(1 - eccentricity)), 0.0_wp]
    q = [cos(0.15_wp), 0.1_wp, 0.05_wp, sin(0.15_wp)]
    q = q/norm2(q)
    m = moments*[0.0_wp, 0.0_wp, n]
    call pull(x, q, f, tau, v)
    print '(a)', 'orbits   r [km]   long axis off the sphere   spin/n    energy/start - 1   momentum/start'
    do step = 0, 20*per_orbit
        if (step > 0) then
            do i = 1, plan%stages
                if (abs(plan%drift(i)) > 0.0_wp) then
                    call free_flow(body, plan%drift(i), m, q)
                    x = x + plan%drift(i)/reduced_mass*p
                    call pull(x, q, f, tau, v)
                end if
                m = m + plan%kick(i)*tau
                p = p + plan%kick(i)*f
            end do
        end if
        if (mod(step, 2*per_orbit) /= 0) cycle
        energy = sum(p**2)/(2*reduced_mass) + kinetic_energy(body, m) + v
        momentum = cross(x, p) + quat_rotate(q, m)
        if (step == 0) then
            start_energy = energy
            start = momentum
        end if
        print '(i6,f9.4,f19.3,f15.3,es18.1,f20.12)', step/per_orbit, norm2(x), &
            acos(abs(dot_product(quat_rotate(q, [1.0_wp, 0.0_wp, 0.0_wp]), x))/norm2(x)), &
            norm2(m/moments)/n, energy/start_energy - 1, dot_product(momentum, start)/sum(start**2)
    end do
end program scene9_two_bodies

! Output:
!   orbits   r [km]   long axis off the sphere   spin/n    energy/start - 1   momentum/start
!        0   1.1400              0.315          1.000           0.0E+00      1.000000000000
!        2   1.1426              0.354          0.812          -1.7E-10      1.000000000000
!        4   1.1429              0.180          0.976          -1.5E-10      1.000000000000
!        6   1.1507              0.250          0.788          -5.6E-10      1.000000000000
!        8   1.1472              0.218          1.070          -2.9E-10      1.000000000000
!       10   1.1528              0.087          0.646          -5.7E-10      1.000000000000
!       12   1.1521              0.367          1.180          -4.2E-10      1.000000000000
!       14   1.1639              0.313          1.048          -9.6E-10      1.000000000000
!       16   1.1779              0.395          0.600          -1.6E-09      1.000000000000
!       18   1.1863              0.527          1.250          -1.9E-09      1.000000000000
!       20   1.1881              0.183          1.533          -1.9E-09      1.000000000000
