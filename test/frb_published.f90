!> Numbers that others published on moving rigid bodies, with what the library gives for them.
module frb_published
    use frb_agm, only: ellip_k
    use frb_free_flow, only: free_flow, rigid_body
    use frb_free_motion, only: free_motion
    use frb_invariants, only: total_energy
    use frb_kinds, only: wp, pi, two_pi
    use frb_published_scenes, only: tumbler, pulse, new_orbit
    use frb_rotations, only: quat_product, quat_rotate, quat_to_matrix, matrix_to_quat
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    implicit none
    private

    public :: published_row, published_rows

    !> A published number, the library's number, and the difference that the digits of the source allow.
    type :: published_row
        character(48) :: what = ''
        character(40) :: source = ''
        real(wp) :: published = 0.0_wp
        real(wp) :: ours = 0.0_wp
        real(wp) :: bound = 0.0_wp
    end type published_row

    real(wp), parameter :: degree = pi/180
    character(*), parameter :: recomputed = 'another integrator at 1e-13'

contains

    subroutine published_rows(rows)
        type(published_row), allocatable, intent(out) :: rows(:)

        allocate (rows(0))
        call tumbling_brick(rows)
        call gravity_gradient_boom(rows)
        call heavy_top_of_rods(rows)
        call toutatis(rows)
        call torque_in_time(rows)
        call top_of_simo_and_wong(rows)
    end subroutine published_rows

    subroutine add(rows, what, source, published, ours, bound)
        type(published_row), allocatable, intent(inout) :: rows(:)
        character(*), intent(in) :: what, source
        real(wp), intent(in) :: published, ours, bound
        type(published_row), allocatable :: more(:)

        allocate (more(size(rows) + 1))
        more(:size(rows)) = rows
        more(size(more)) = published_row(what, source, published, ours, bound)
        call move_alloc(more, rows)
    end subroutine add

    !> One row for each component of a vector, under its own name.
    subroutine add_vector(rows, names, source, published, ours, bound)
        type(published_row), allocatable, intent(inout) :: rows(:)
        character(*), intent(in) :: names(:), source
        real(wp), intent(in) :: published(:), ours(:), bound
        integer :: i

        do i = 1, size(names)
            call add(rows, names(i), source, published(i), ours(i), bound)
        end do
    end subroutine add_vector

    !> Check-case 2 of NASA's Engineering and Safety Center: a brick tumbling freely, seen from the Earth.
    !> At the start the body's axes point north, east and down: to +Z, +Y and -X of the inertial frame.
    subroutine tumbling_brick(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: moments(3) = [0.001894220_wp, 0.006211019_wp, 0.007194665_wp]    ! slug ft2
        real(wp), parameter :: t = 30.0_wp
        real(wp), parameter :: frame_turn = 5.745522e-5_wp*degree + 7.292115e-5_wp*t
        character(*), parameter :: names(6) = [character(40) :: 'tumbling brick, p at 30 s [deg/s]', &
            'q', 'r', 'roll [deg]', 'pitch', 'yaw']
        real(wp) :: m(3), q(4), north_east_down(3, 3), r(3, 3), ours(6)

        north_east_down = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, -1.0_wp, 0.0_wp, 0.0_wp], &
                                  [3, 3])
        m = moments*[10.0_wp, 20.0_wp, 30.0_wp]*degree
        q = matrix_to_quat(north_east_down)
        call free_flow(rigid_body(moments), t, m, q)
        ours(1:3) = m/moments/degree
        r(:, 1) = [cos(frame_turn), sin(frame_turn), 0.0_wp]
        r(:, 2) = [-sin(frame_turn), cos(frame_turn), 0.0_wp]
        r(:, 3) = [0.0_wp, 0.0_wp, 1.0_wp]
        ! Columns: the body's axes in the local frame.
        r = matmul(transpose(matmul(r, north_east_down)), quat_to_matrix(q))
        ours(4:6) = [atan2(r(3, 2), r(3, 3)), -asin(r(3, 1)), atan2(r(2, 1), r(1, 1))]/degree
        call add_vector(rows, names, 'NASA/TM-2015-218675, vol. 2, SIM 5', &
            [12.61842377_wp, -17.3974441_wp, 31.11960301_wp, -56.15127539_wp, -3.819633201_wp, &
             -4.289288509_wp], ours, 1.0e-4_wp)
        call add_vector(rows, names, recomputed, &
            [12.61839078_wp, -17.39747476_wp, 31.11958889_wp, -56.15130759_wp, -3.81965492_wp, &
             -4.28935504_wp], ours, 1.0e-8_wp)
    end subroutine tumbling_brick

    !> NASA JEOD, SIM_dyncomp RUN_10A: a boom turned by the gravity gradient on a circular orbit.
    subroutine gravity_gradient_boom(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: moments(3) = [500.0_wp, 12250.0_wp, 12250.0_wp]      ! kg m2
        real(wp), parameter :: omega(3) = [-1.97989570839746e-5_wp, -0.001134281491669957_wp, 0.0_wp]
        real(wp), parameter :: to_body(3, 3) = reshape([ &
            -0.6443912270931274_wp, -0.7615617870471506_wp, 0.06916350883930189_wp, &
            0.05284210190675609_wp, -0.1345758407161209_wp, -0.9894933326514259_wp, &
            0.7628680480341864_wp, -0.6339660776454052_wp, 0.1269620166955875_wp], [3, 3])
        character(*), parameter :: source = 'JEOD, SIM_dyncomp, RUN_10A'
        type(tumbler) :: scene
        real(wp) :: m(3), q(4)
        integer, parameter :: steps = 960

        scene = tumbler(moments, new_orbit(3.986004415e14_wp, &
            [-4292653.41_wp, 955168.47_wp, 5139356.57_wp], [109.649663_wp, -7527.726490_wp, 1484.521489_wp]))
        m = moments*omega
        q = matrix_to_quat(transpose(to_body))
        call integrate(rigid_body(moments), splitting_scheme('srkn14'), scene, 28800.0_wp/steps, steps, &
                       m, q, compensated=.true.)
        call add_vector(rows, [character(44) :: 'boom on an orbit, rate 1 at 28800 s [rad/s]', 'rate 2', &
            'rate 3'], source, &
            [-1.97989570839746e-5_wp, -0.001080027400090759_wp, -0.0007098670173048437_wp], m/moments, &
            1.0e-14_wp)
        call add_vector(rows, [character(44) :: 'boom on an orbit, axis 1 in space, x', 'y', 'z'], source, &
            [-0.1303977224153033_wp, -0.9235551691194414_wp, 0.3606137595567613_wp], &
            quat_rotate(q, [1.0_wp, 0.0_wp, 0.0_wp]), 1.0e-11_wp)
    end subroutine gravity_gradient_boom

    !> Heavy top of Bruls, Cardona and Arnold: mass 15, moments about the centre, which is 1 from the fixed
    !> point along axis 2.
    subroutine heavy_top_of_rods(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: mass = 15.0_wp, gravity = 9.81_wp
        real(wp), parameter :: moments(3) = [0.234375_wp + mass, 0.46875_wp, 0.234375_wp + mass]
        real(wp), parameter :: arm(3) = [0.0_wp, 1.0_wp, 0.0_wp]
        character(*), parameter :: names(7) = [character(44) :: &
            'heavy top on a rod, displacement at 2 s, x', 'y', 'z', 'attitude, q0', 'q1', 'q2', 'q3']
        type(heavy_top) :: top
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), energy, ours(7)
        integer, parameter :: steps = 8000

        top = heavy_top(force=[0.0_wp, 0.0_wp, mass*gravity], centre=arm)
        body = rigid_body(moments)
        m = moments*[0.0_wp, 150.0_wp, -4.61538_wp]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call integrate(body, splitting_scheme('srkn14'), top, 2.0_wp/steps, steps, m, q, compensated=.true.)
        energy = total_energy(body, top, 2.0_wp, m, q)
        if (q(1) < 0.0_wp) q = -q
        ours = [quat_rotate(q, arm) - arm, q]
        call add_vector(rows, names, 'Bruls, Cardona, Arnold, used at 5e-4', &
            [-0.150416985652933_wp, -1.724164450779749_wp, -0.673023460701136_wp, 0.122947275600560_wp, &
             -0.491079359219981_wp, 0.350430794926147_wp, -0.787986857972906_wp], ours, 1.3e-6_wp)
        call add_vector(rows, names, recomputed, &
            [-0.150416822746_wp, -1.724165591637_wp, -0.673022269560_wp, 0.122947135042_wp, &
             -0.491079892551_wp, 0.350430030343_wp, -0.787986887550_wp], ours, 1.0e-12_wp)
        call add(rows, 'heavy top on a rod, energy', recomputed, 5435.696790865547_wp, energy, 1.0e-8_wp)
    end subroutine heavy_top_of_rods

    !> Toutatis: periods, and attitudes seen by radar in December 1992. Published angles turn from the body's
    !> axes to those of the ecliptic by z, x, z.
    subroutine toutatis(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: moments(3) = [3.0836_wp, 3.235_wp, 1.0_wp]
        real(wp), parameter :: omega(3) = [14.51_wp, 33.529_wp, -98.709_wp]*degree      ! [rad/d]
        real(wp), parameter :: epoch = (9 + 30) + (17 + (49 + 47/60.0_wp)/60)/24       ! of 1992-11-09
        real(wp), parameter :: seen(4, 5) = reshape([ &
            60 + 2 + (21 + 40/60.0_wp)/24, 122.2_wp, 86.5_wp, 107.0_wp, &
            60 + 3 + (19 + 30/60.0_wp)/24, 86.3_wp, 81.8_wp, 24.5_wp, &
            60 + 4 + (18 + 10/60.0_wp)/24, 47.8_wp, 60.7_wp, 284.0_wp, &
            60 + 5 + (18 + 50/60.0_wp)/24, 14.6_wp, 39.4_wp, 207.1_wp, &
            60 + 6 + (17 + 30/60.0_wp)/24, 331.3_wp, 23.7_wp, 151.6_wp], [4, 5])
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), off(3)
        character(2) :: day
        integer :: i

        motion = free_motion(rigid_body(moments), moments*omega, &
                             from_euler([145.498_wp, 65.865_wp, 241.524_wp]*degree))
        call add(rows, 'Toutatis, turn about the long axis [d]', 'Zhao, Ji et al. 2015, +- 0.03', 5.38_wp, &
                 motion%period(), 0.03_wp)
        call add(rows, 'Toutatis, precession [d]', 'Zhao, Ji et al. 2015, +- 0.03', 7.40_wp, &
                 motion%precession_period(), 0.03_wp)
        call add(rows, 'Toutatis, turn about the long axis [d]', recomputed, 5.3685303_wp, motion%period(), &
                 6.0e-8_wp)
        do i = 1, size(seen, 2)
            call motion%at(seen(1, i) - epoch, m, q)
            off = modulo(euler_angles(q) - seen(2:4, i)*degree + pi, two_pi) - pi
            write (day, '(i2)') 1 + i
            call add(rows, 'Toutatis, angles off the radar''s, Dec.'//day//' [deg]', &
                     'Hudson, Ostro 1995, to 3 to 15', 0.0_wp, maxval(abs(off))/degree, 15.0_wp)
        end do
    end subroutine toutatis

    !> Turns by angle(1) about z, angle(2) about the new x, angle(3) about the new z.
    pure function from_euler(angle) result(q)
        real(wp), intent(in) :: angle(3)
        real(wp) :: q(4)

        q = quat_product(quat_product([cos(angle(1)/2), 0.0_wp, 0.0_wp, sin(angle(1)/2)], &
                                      [cos(angle(2)/2), sin(angle(2)/2), 0.0_wp, 0.0_wp]), &
                         [cos(angle(3)/2), 0.0_wp, 0.0_wp, sin(angle(3)/2)])
    end function from_euler

    !> The angles of `from_euler`.
    pure function euler_angles(q) result(angle)
        real(wp), intent(in) :: q(4)
        real(wp) :: angle(3)
        real(wp) :: r(3, 3)

        r = quat_to_matrix(q)
        angle = [atan2(r(1, 3), -r(2, 3)), acos(r(3, 3)), atan2(r(3, 1), r(3, 2))]
    end function euler_angles

    !> Problem EULR of Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.10: a body
    !> pushed for a while, I3 w3' = (I1 - I2) w1 w2 + sin^2 t/4 for 3 pi <= t <= 4 pi, free before and after.
    subroutine torque_in_time(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: moments(3) = [0.5_wp, 2.0_wp, 3.0_wp]
        integer, parameter :: steps = 200
        type(rigid_body) :: body
        type(pulse) :: scene
        real(wp) :: m(3), q(4), t

        body = rigid_body(moments)
        m = moments*[1.0_wp, 0.0_wp, 0.9_wp]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call free_flow(body, 3*pi, m, q)
        t = 3*pi
        call integrate(body, splitting_scheme('srkn14'), scene, pi/steps, steps, m, q, t=t)
        call free_flow(body, 20 - 4*pi, m, q)
        call add_vector(rows, [character(44) :: 'pulse of torque (EULR), w1 at 20', 'w2', 'w3'], &
            'Runge-Kutta in quadruple precision', &
            [-0.9011799837228600526_wp, 0.3426684229481774947_wp, 0.9955101169010664169_wp], m/moments, &
            1.0e-13_wp)
    end subroutine torque_in_time

    !> Top of Simo and Wong: its axis falls from the tilt 0.05 at rest and comes back. With u the cosine of
    !> the tilt, u'^2 = (u0 - u) (b (1 - u^2) - a^2 (u0 - u)), a = J3 w/J1, b = 2 weight/J1 (Lagrange).
    subroutine top_of_simo_and_wong(rows)
        type(published_row), allocatable, intent(inout) :: rows(:)
        real(wp), parameter :: moments(3) = [5.0_wp, 5.0_wp, 1.0_wp]
        real(wp), parameter :: weight = 20.0_wp, tilt = 0.05_wp, spin = 50.0_wp
        character(*), parameter :: source = 'Lagrange, closed form'
        integer, parameter :: steps = 400
        type(heavy_top) :: top
        type(rigid_body) :: body
        real(wp) :: a, b, u0, u1, u2, root, period, m(3), q(4), axis(3), precession
        integer :: i

        a = moments(3)*spin/moments(1)
        b = 2*weight/moments(1)
        u0 = cos(tilt)
        root = sqrt(a**4 - 4*b*(a**2*u0 - b))
        u1 = 2*(a**2*u0 - b)/(a**2 + root)
        u2 = (a**2 + root)/(2*b)
        period = 4*ellip_k(sqrt((u0 - u1)/(u2 - u1)))/sqrt(b*(u2 - u1))
        ! phi' = a (u0 - u)/(1 - u^2); with u = u1 + (u0 - u1) sin^2 s the integrand is smooth and periodic.
        precession = 0.0_wp
        do i = 1, 64
            associate (u => u1 + (u0 - u1)*sin(pi*i/64)**2)
                precession = precession + 2*pi/64*a*(u0 - u)/(1 - u**2)/sqrt(b*(u2 - u))
            end associate
        end do

        top = heavy_top(force=[0.0_wp, 0.0_wp, weight])
        body = rigid_body(moments)
        m = [0.0_wp, 0.0_wp, spin]
        q = [cos(tilt/2), sin(tilt/2), 0.0_wp, 0.0_wp]
        call integrate(body, splitting_scheme('srkn14'), top, period/2/steps, steps, m, q, compensated=.true.)
        axis = quat_rotate(q, [0.0_wp, 0.0_wp, 1.0_wp])
        call add(rows, 'top of Simo, Wong: cosine of the widest tilt', source, u1, axis(3), 1.0e-13_wp)
        call integrate(body, splitting_scheme('srkn14'), top, period/2/steps, steps, m, q, compensated=.true.)
        axis = quat_rotate(q, [0.0_wp, 0.0_wp, 1.0_wp])
        call add(rows, 'cosine after one nutation', source, u0, axis(3), 1.0e-13_wp)
        call add(rows, 'precession in one nutation [rad]', source, precession, &
                 atan2(axis(2), axis(1)) + pi/2, 1.0e-11_wp)
        call add(rows, 'top of Simo, Wong: energy', 'Solfec (keeps it to 1e-3)', 1250 + weight*u0, &
                 total_energy(body, top, period, m, q), 1.0e-11_wp)
    end subroutine top_of_simo_and_wong

end module frb_published
