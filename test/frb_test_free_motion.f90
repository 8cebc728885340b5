!> One motion at many times, its period and its precession.
module frb_test_free_motion
    use frb_checks, only: tally, worst_of
    use frb_free_flow, only: free_flow, rigid_body
    use frb_free_motion, only: free_motion
    use frb_kinds, only: wp, pi, two_pi
    use frb_reference_cases, only: reference_case, read_cases, score_momentum, score_attitude
    use frb_rotations, only: cross, quat_conjugate, quat_product, quat_rotate
    use frb_status, only: status_ok, status_bad_moments, status_bad_momentum, status_bad_attitude, &
        status_bad_count, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_value, &
        ieee_quiet_nan
    implicit none
    private

    public :: test_free_motion

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: unit(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    real(wp), parameter :: start(4) = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
    real(wp), parameter :: times(4) = [0.0_wp, -3.5_wp, 12.0_wp, 1.0e4_wp]

contains

    subroutine test_free_motion(t)
        type(tally), intent(inout) :: t
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), moved_m(3), moved_q(4), ms(3, 4), qs(4, 4)
        integer :: i
        logical :: same

        call t%open_suite('free-motion', 51)
        call check_cases(t)
        call check_period(t, [1.0_wp, 2.0_wp, 3.0_wp], [0.3_wp, 0.5_wp, 0.8_wp], 'about-the-third-axis')
        call check_period(t, [3.0_wp, 1.0_wp, 2.0_wp], [0.1_wp, -0.9_wp, 0.3_wp], 'about-the-first-axis')
        call check_period(t, [2.0_wp, 2.0_wp, 3.0_wp], [0.4_wp, 0.1_wp, -0.7_wp], 'of-a-symmetric-body')
        call check_period(t, [1.0e-100_wp, 2.0e-100_wp, 3.0e-100_wp], [4.0e150_wp, 1.0e150_wp, -7.0e150_wp], &
                          'of-huge-momentum')

        motion = free_motion(rigid_body([2.0_wp, 2.0_wp, 3.0_wp]), [0.3_wp, 0.4_wp, 1.2_wp], unit)
        call t%close_to('period-of-a-symmetric-body', motion%period(), two_pi/(1.2_wp/6), &
                        8*eps*motion%period())
        call t%close_to('symmetric-body-precesses-at-the-rate-of-its-transverse-moment', &
                        motion%precession(), 1.3_wp/2*motion%period(), 8*eps*motion%precession())
        motion = free_motion(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), [0.4_wp, 0.8_wp, 0.4_wp], unit)
        call t%ok('no-period-on-the-separatrix', &
                  .not. motion%periodic .and. .not. ieee_is_finite(motion%period()))
        motion = free_motion(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), [0.0_wp, 0.8_wp, 0.0_wp], unit)
        call t%ok('no-period-on-the-middle-axis', .not. motion%periodic)
        motion = free_motion(rigid_body([2.0_wp, 2.0_wp, 2.0_wp]), [0.1_wp, 0.8_wp, 0.0_wp], unit)
        call t%ok('no-period-of-a-sphere', .not. motion%periodic)
        call motion%at(2.0_wp, m, q)
        call t%close_to('sphere-turns-uniformly', q(1), cos(sqrt(0.65_wp)/2), 2*eps)

        motion = free_motion(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), [0.4_wp, 0.7_wp, 0.4_wp], start)
        call motion%at(times, ms, qs)
        same = .true.
        do i = 1, size(times)
            call motion%at(times(i), m, q)
            same = same .and. all(abs(m - ms(:, i)) <= 0.0_wp) .and. all(abs(q - qs(:, i)) <= 0.0_wp)
        end do
        call t%ok('array-of-times-equals-each-time', same)
        moved_m = [0.4_wp, 0.7_wp, 0.4_wp]
        moved_q = start
        call free_flow(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), 12.0_wp, moved_m, moved_q)
        call t%close_to('sign-of-the-quaternion-is-that-of-the-flow', qs(:, 3), moved_q, 64*eps)
        call check_refused(t)
        call check_precession(t)
        call check_published_periods(t)
        call t%close_suite()
    end subroutine test_free_motion

    !> The states of all reference cases, in units of the inherent sensitivity.
    subroutine check_cases(t)
        type(tally), intent(inout) :: t
        type(reference_case), allocatable :: cases(:)
        type(free_motion) :: motion
        real(wp) :: worst_m, worst_q, m(3), q(4)
        integer :: i

        call read_cases('data/reference/cases.txt', cases)
        worst_m = 0.0_wp
        worst_q = 0.0_wp
        do i = 1, size(cases)
            motion = free_motion(rigid_body(cases(i)%moments), cases(i)%m0, unit)
            call motion%at(cases(i)%h, m, q)
            worst_m = worst_of(worst_m, score_momentum(cases(i), m))
            worst_q = worst_of(worst_q, score_attitude(cases(i), q))
        end do
        call t%at_most('momentum-at-any-time-is-within-4-units', worst_m, 4.0_wp)
        call t%at_most('attitude-at-any-time-is-within-4-units', worst_q, 4.0_wp)
    end subroutine check_cases

    !> Input that is refused; no momentum; periods that overflow or underflow.
    subroutine check_refused(t)
        type(tally), intent(inout) :: t
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), ms(3, 4), qs(4, 4), nan
        integer :: stat

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        motion = free_motion(rigid_body([-1.0_wp, 2.0_wp, 3.0_wp]), [0.4_wp, 0.7_wp, 0.4_wp], start)
        call motion%at(1.0_wp, m, q, stat)
        call t%equal('bad-body-is-refused', stat, status_bad_moments)
        motion = free_motion(rigid_body([1.0_wp, 2.0_wp, 3.0_wp]), [1.0_wp, nan, 0.0_wp], unit)
        call t%equal('nan-momentum-is-refused', motion%status, status_bad_momentum)
        motion = free_motion(rigid_body([1.0_wp, 2.0_wp, 3.0_wp]), [1.0_wp, 0.0_wp, 0.0_wp], 0*unit)
        call t%equal('zero-quaternion-is-refused', motion%status, status_bad_attitude)
        motion = free_motion(rigid_body([1.0_wp, 2.0_wp, 3.0_wp]), [0.0_wp, 0.0_wp, 0.0_wp], start)
        call motion%at(5.0_wp, m, q, stat)
        call t%ok('body-at-rest-stays-at-rest', stat == status_ok .and. all(abs(m) <= 0.0_wp) &
                  .and. all(abs(q - start) <= 0.0_wp))
        call motion%at(nan, m, q, stat)
        call t%equal('nan-time-is-refused', stat, status_bad_time)
        call motion%at(times, ms, qs(:, 1:2), stat)
        call t%equal('sizes-that-differ-are-refused', stat, status_bad_count)
        call t%ok('refused-times-give-the-state-at-the-start', all(abs(ms(:, 4)) <= 0.0_wp) &
                  .and. all(abs(qs(:, 2) - start) <= 0.0_wp))
        motion = free_motion(rigid_body([1.0e290_wp, 1.5e290_wp, 2.0e290_wp]), &
                             [1.0e-12_wp, 2.0e-12_wp, 3.0e-12_wp], start)
        call motion%at(1.0e307_wp, m, q, stat)
        call t%ok('period-near-overflow-does-no-harm', stat == status_ok .and. all(ieee_is_finite(q)))
        motion = free_motion(rigid_body([1.0e-300_wp, 1.5e-300_wp, 2.0e-300_wp]), &
                             [1.0e150_wp, 2.0e150_wp, 3.0e150_wp], start)
        call motion%at(1.0_wp, m, q, stat)
        call t%ok('period-that-underflows-does-no-harm', stat == status_ok .and. .not. motion%periodic &
                  .and. all(ieee_is_finite(q)))
    end subroutine check_refused

    !> After the period m is back, and the attitude is turned about the momentum in space by the precession.
    subroutine check_period(t, moments, m0, name)
        type(tally), intent(inout) :: t
        real(wp), intent(in) :: moments(3), m0(3)
        character(*), intent(in) :: name
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), change(4), axis(3), tolerance

        motion = free_motion(rigid_body(moments), m0, start)
        m = m0
        q = start
        tolerance = 16*eps*max(1.0_wp, motion%precession())
        call free_flow(rigid_body(moments), motion%period(), m, q)
        axis = m0/maxval(abs(m0))
        axis = quat_rotate(start, axis/sqrt(sum(axis**2)))
        change = quat_product([cos(0.5_wp*motion%precession()), sin(0.5_wp*motion%precession())*axis], start)
        change = quat_product(q, quat_conjugate(change))
        call t%ok('momentum-is-back-and-attitude-turned-after-the-period-'//name, &
                  all(abs(m - m0) <= tolerance*maxval(abs(m0))) .and. all(abs(change(2:4)) <= tolerance))
    end subroutine check_period

    !> The precession is the angle by which the long axis goes round the momentum, followed point by point.
    subroutine check_precession(t)
        type(tally), intent(inout) :: t
        type(free_motion) :: motion
        real(wp), parameter :: tilted(3, 3) = reshape( &
            [2.5_wp, 0.0_wp, 0.5_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, 2.5_wp], [3, 3])   ! 2, 2 and 3
        real(wp) :: rate

        call check_way(t, [1.0_wp, 2.0_wp, 3.0_wp], [0.9_wp, 0.2_wp, 0.1_wp], 'turning-about-the-long-axis')
        call check_way(t, [1.0_wp, 2.0_wp, 3.0_wp], [0.9_wp, 0.9_wp, 0.4_wp], 'far-from-the-long-axis')
        call check_way(t, [1.0_wp, 2.0_wp, 3.0_wp], [0.1_wp, 0.2_wp, 0.9_wp], 'turning-about-the-short-axis')
        call check_way(t, [1.0_wp, 2.0_wp, 3.0_wp], [0.9_wp, 0.6_wp, -0.9_wp], 'far-from-the-short-axis')
        call check_way(t, [3.0_wp, 1.0_wp, 2.0_wp], [0.1_wp, -0.9_wp, 0.3_wp], 'with-the-long-axis-second')
        call check_way(t, [2.0_wp, 3.0_wp, 0.5_wp], [0.4_wp, 0.9_wp, 0.5_wp], 'with-the-long-axis-third')
        call check_way(t, [1.0_wp, 100.0_wp, 100.5_wp], [0.9_wp, 0.2_wp, 0.1_wp], 'of-a-rod-about-its-axis')
        call check_way(t, [1.0_wp, 100.0_wp, 100.0_wp], [0.9_wp, 0.2_wp, 0.1_wp], 'of-a-symmetric-rod')
        call check_way(t, [2.0_wp, 2.0001_wp, 3.0_wp], [0.1_wp, 0.3_wp, 0.9_wp], 'of-a-body-nearly-oblate')

        call t%close_to('precession-agrees-with-25-digits', [ &
            relative([1.0_wp, 100.0_wp, 100.5_wp], [0.9_wp, 0.2_wp, 0.1_wp], &
                     6.523168684893318828514299e-2_wp), &
            relative([0.001_wp, 1.0_wp, 1.0005_wp], [0.5_wp, 0.3_wp, 0.001_wp], &
                     7.332900834272230187987869e-3_wp), &
            relative([1.0_wp, 2.0_wp, 3.0_wp], [0.9_wp, 0.9_wp, 0.4_wp], 6.597142739268479195382250_wp), &
            relative([1.0_wp, 2.0_wp, 3.0_wp], [0.1_wp, 0.2_wp, 0.9_wp], 6.628755948142308895147843_wp), &
            relative([2.0_wp, 2.0001_wp, 3.0_wp], [0.1_wp, 0.3_wp, 0.9_wp], 13.69699563606114185585459_wp), &
            relative([1.0_wp, 1.5_wp, 4.0_wp], [0.5_wp, 0.3_wp, 0.35_wp], 10.68799431646088551582323_wp), &
            relative([1.0_wp, 3.0_wp, 3.5_wp], [0.7_wp, 0.5_wp, 0.3_wp], 3.655799076152315290256536_wp)], &
            [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 4*eps)

        ! |m| T/I1 about the symmetry axis of an oblate body, by its moments and by its tensor.
        motion = free_motion(rigid_body([2.0_wp, 2.0_wp, 3.0_wp]), [0.0_wp, 0.6_wp, 0.1_wp], start)
        rate = sqrt(0.37_wp)/2
        call t%close_to('disc-precesses-about-its-symmetry-axis', motion%precession_period(), two_pi/rate, &
                        16*eps*two_pi/rate)
        motion = free_motion(rigid_body(tilted), [0.1_wp, 0.6_wp, 0.2_wp], start)
        rate = sqrt(0.41_wp)/2
        call t%close_to('disc-by-its-tensor-precesses-about-its-symmetry-axis', motion%precession_period(), &
                        two_pi/rate, 64*eps*two_pi/rate)
        motion = free_motion(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), [0.4_wp, 0.8_wp, 0.4_wp], unit)
        call t%ok('no-precession-on-the-separatrix', ieee_is_nan(motion%precession()) &
                  .and. .not. ieee_is_finite(motion%precession_period()))
    end subroutine check_precession

    !> Error of the precession against the value by extrapolated integration in quadruple precision.
    function relative(moments, m0, expected) result(error)
        real(wp), intent(in) :: moments(3), m0(3), expected
        real(wp) :: error
        type(free_motion) :: motion

        motion = free_motion(rigid_body(moments), m0, unit)
        error = motion%precession()/expected - 1
    end function relative

    subroutine check_way(t, moments, m0, name)
        type(tally), intent(inout) :: t
        real(wp), intent(in) :: moments(3), m0(3)
        character(*), intent(in) :: name
        integer, parameter :: points = 400
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), pole(3), zero(3), ninety(3), long(3), angle, last_angle, turned
        integer :: i

        motion = free_motion(rigid_body(moments), m0, start)
        pole = quat_rotate(start, m0/norm2(m0))
        long = 0.0_wp
        long(minloc(moments, 1)) = 1.0_wp
        zero = quat_rotate(start, long)
        zero = zero - dot_product(zero, pole)*pole
        ninety = cross(pole, zero)
        turned = 0.0_wp
        last_angle = 0.0_wp
        do i = 1, points
            call motion%at(motion%period()*i/points, m, q)
            associate (axis => quat_rotate(q, long))
                angle = atan2(dot_product(axis, ninety), dot_product(axis, zero))
            end associate
            turned = turned + modulo(angle - last_angle + pi, two_pi) - pi
            last_angle = angle
        end do
        call t%close_to('precession-is-the-way-of-the-long-axis-'//name, motion%precession(), turned, &
                        64*eps*points)
        call t%close_to('precession-period-is-the-mean-'//name, motion%precession_period(), &
                        two_pi*motion%period()/turned, 64*eps*points*motion%precession_period())
    end subroutine check_way

    !> Toutatis: moments and rates of 1992-11-09 after Takahashi, Busch and Scheeres (2013), periods of Hudson
    !> and Ostro (1995), 5.41 and 7.35 d, and of Zhao, Ji et al. (2015), 5.38 and 7.40 d, each within 0.03 d.
    !> Apophis: Pravec et al. (2014), 263 h and 27.38 h, I1/I3 = 0.61, I2/I3 = 0.965, and an energy of
    !> 1.024 +- 0.013 times the least for the momentum.
    subroutine check_published_periods(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: toutatis(3) = [3.0836_wp, 3.235_wp, 1.0_wp]
        real(wp), parameter :: apophis(3) = [0.61_wp, 0.965_wp, 1.0_wp]
        real(wp), parameter :: rates(3) = [14.51_wp, 33.529_wp, -98.709_wp]*pi/180      ! [rad/d]
        type(free_motion) :: motion
        real(wp) :: m(3), energy, wide
        integer :: i

        motion = free_motion(rigid_body(toutatis), toutatis*rates, unit)
        call t%close_to('toutatis-turns-about-its-long-axis-in-5.38-days', motion%period(), 5.38_wp, 0.03_wp)
        call t%close_to('toutatis-precesses-in-7.40-days', motion%precession_period(), 7.40_wp, 0.03_wp)
        call t%close_to('period-of-toutatis-by-another-integrator', motion%period(), 5.3685303_wp, 1.0e-7_wp)
        call t%close_to('precession-of-toutatis-by-another-integrator', motion%precession_period(), &
                        7.4117_wp, 1.0e-4_wp)

        ! m2 = 0, |m| = 1: 2 T = m1^2/I1 + m3^2/I3 = energy/I3; the ratio grows with the energy.
        energy = 1.012_wp
        wide = 0.024_wp
        do i = 1, 40
            wide = wide/2
            m(1) = sqrt((energy + wide - 1)/(1/apophis(1) - 1))
            m(2) = 0.0_wp
            m(3) = sqrt(1 - m(1)**2)
            motion = free_motion(rigid_body(apophis), m, unit)
            if (motion%period()/motion%precession_period() < 263/27.38_wp) energy = energy + wide
        end do
        call t%close_to('periods-of-apophis-give-its-published-energy', energy, 1.024_wp, 0.013_wp)
        call t%close_to('energy-found-has-the-published-ratio', &
                        motion%period()/motion%precession_period(), 263/27.38_wp, 1.0e-6_wp)
    end subroutine check_published_periods

end module frb_test_free_motion
