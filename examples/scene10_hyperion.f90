!> A tumbling moon like Hyperion: moments 0.314, 0.474, 0.542 on an orbit of eccentricity 0.1, turned by the
!> gravity of its planet. With one turn per orbit the rotation is chaotic: the distance of two starts, 1e-8 at
!> first, grows by a factor e in about an orbit. With eight turns per orbit it is regular. No tides; the orbit
!> does not change.
!> J. Wisdom, S. J. Peale, F. Mignard, Icarus 58 (1984) 137.
module frb_tumbler
    use frb, only: wp, body_scene, quat_rotate_back, status_ok
    implicit none
    private

    public :: tumbler, new_orbit

    include 'tumbler_model.inc'

end module frb_tumbler

program scene10_hyperion
    use frb, only: wp, rigid_body, splitting_scheme, integrate
    use frb_tumbler, only: tumbler, new_orbit
    implicit none
    real(wp), parameter :: moments(3) = [0.314_wp, 0.474_wp, 0.542_wp]
    real(wp), parameter :: e = 0.1_wp, orbit_time = 2*acos(-1.0_wp)
    integer, parameter :: per_orbit = 100, orbits = 2       ! steps, and orbits from line to line
    type(tumbler) :: moon
    type(rigid_body) :: body
    real(wp) :: m(3, 2, 2), q(4, 2, 2), t
    integer :: i, j, k

    ! From the pericentre; half axis and mean motion are 1.
    moon = tumbler(moments, new_orbit(1.0_wp, [1 - e, 0.0_wp, 0.0_wp], &
                                      [0.0_wp, sqrt((1 + e)/(1 - e)), 0.0_wp]))
    body = rigid_body(moments)
    do j = 1, 2
        do k = 1, 2
            q(:, k, j) = [cos(0.1_wp), 0.1_wp, 0.0_wp, sin(0.1_wp)]
            q(:, k, j) = q(:, k, j)/norm2(q(:, k, j))
            m(:, k, j) = moments*[0.0_wp, 0.1_wp, merge(1.0_wp, 8.0_wp, j == 1)]
        end do
        m(1, 2, j) = m(1, 2, j) + 1.0e-8_wp
    end do
    print '(a)', 'orbits   two starts 1e-8 apart are [rad] apart'
    print '(a)', '         one turn an orbit    eight turns'
    do i = 0, 10
        if (i > 0) then
            do j = 1, 2
                do k = 1, 2
                    t = (i - 1)*orbits*orbit_time
                    call integrate(body, splitting_scheme('srkn14'), moon, orbit_time/per_orbit, &
                                   orbits*per_orbit, m(:, k, j), q(:, k, j), t=t)
                end do
            end do
        end if
        print '(i6,2es18.1)', i*orbits, &
            (2*min(norm2(q(:, 1, j) - q(:, 2, j)), norm2(q(:, 1, j) + q(:, 2, j))), j=1, 2)
    end do
end program scene10_hyperion

! Output:
!   orbits   two starts 1e-8 apart are [rad] apart
!            one turn an orbit    eight turns
!        0           0.0E+00           0.0E+00
!        2           2.7E-08           5.8E-09
!        4           2.7E-07           5.0E-09
!        6           1.1E-06           5.1E-09
!        8           1.4E-06           2.5E-09
!       10           6.0E-06           4.5E-09
!       12           1.7E-05           6.5E-09
!       14           5.5E-05           4.0E-09
!       16           1.7E-03           3.7E-09
!       18           6.8E-02           2.3E-09
!       20           1.8E+00           7.1E-09
