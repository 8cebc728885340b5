!> One body under torque: published values, orders, invariants, observers, refused input.
module frb_test_splitting
    use frb_checks, only: tally, largest
    use frb_claims, only: top_energy, compensated_energy, reversed
    use frb_free_flow, only: free_flow, rigid_body
    use frb_free_motion, only: free_motion
    use frb_invariants, only: invariant_monitor, kinetic_energy, norm_defect, spatial_momentum, total_energy
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product
    use frb_scenes, only: heavy_top, plain_scene
    use frb_schemes, only: splitting_scheme, scheme_names
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_moments, &
        status_bad_momentum, status_bad_option, status_bad_scheme, status_bad_time, status_bad_torque
    use frb_torque_cases, only: top_case, known_top, distance, recorder, pulsed_torque, spoilt_torque, &
        fitted_change, plain_drift, failing_drift, tilting_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan, ieee_positive_inf
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: test_splitting

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_splitting(t)
        type(tally), intent(inout) :: t

        call t%open_suite('splitting', 224)
        call test_values(t)
        call test_top_torque(t)
        call test_orders(t)
        call test_long_run(t)
        call test_invariants(t)
        call test_compensated(t)
        call test_loop(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_splitting

    !> Published values of the paper's example 1, end values by Taylor series, cases with a formula.
    subroutine test_values(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: after_one_step(3) = [-0.3915152739603944_wp, -0.0790616195912371_wp, &
                                                    -0.9166557171043519_wp]
        real(wp), parameter :: at_5000(3) = [0.0659419922367005_wp, 0.3964036062397627_wp, &
                                             -0.9151821877825491_wp]
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(pulsed_torque) :: pulse
        type(spoilt_torque) :: no_torque
        real(wp) :: m(3), q(4), m_free(3), q_free(4), time, angle
        integer :: i

        item = known_top(1)
        scheme = splitting_scheme('srkn14')
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.5_wp, 1, m, q)
        call t%close_to('papers-top-after-one-step', m, after_one_step, 4*eps)
        call integrate(item%body, scheme, item%top, 0.5_wp, 9999, m, q)
        ! The published run used the misprinted a_4.
        call t%close_to('papers-top-at-time-5000', m, at_5000, 1.0e-8_wp)
        do i = 1, 3
            item = known_top(i)
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, item%t/500, 500, m, q)
            call t%at_most('top-ends-where-the-taylor-series-does', distance(m, q, item%m, item%q), 2048*eps)
        end do

        ! About axis 3 alone: m3' = cos t, so m3 = sin t and the angle is (1 - cos t)/I3; from t = 1.
        do i = 1, 2
            scheme = splitting_scheme(merge('srkn14', 'srkn11', i == 1))
            time = 1.0_wp
            m = [0.0_wp, 0.0_wp, sin(1.0_wp)]
            angle = cos(1.0_wp)/2
            q = [cos(angle/2), 0.0_wp, 0.0_wp, -sin(angle/2)]
            call integrate(rigid_body([1.0_wp, 1.5_wp, 2.0_wp]), scheme, pulse, 0.05_wp, 100, m, q, t=time)
            call t%close_to('time-goes-on-by-all-steps', time, 6.0_wp, 4*eps)
            angle = -cos(6.0_wp)/2
            call t%at_most('torque-sees-the-time-of-its-stage', &
                           distance(m, q, [0.0_wp, 0.0_wp, sin(6.0_wp)], &
                                    [cos(angle/2), 0.0_wp, 0.0_wp, sin(angle/2)]), 64*eps)
        end do

        item = known_top(2)
        m = item%m0
        q = item%q0
        no_torque%until = huge(1.0_wp)
        call integrate(item%body, scheme, no_torque, 0.1_wp, 10, m, q)
        m_free = item%m0
        q_free = item%q0
        call free_flow(item%body, 1.0_wp, m_free, q_free)
        call t%at_most('without-torque-it-is-the-free-flow', distance(m, q, m_free, q_free), 64*eps)
    end subroutine test_values

    !> The order seen, between two numbers of steps whose errors are two decades apart or more.
    subroutine test_orders(t)
        type(tally), intent(inout) :: t
        call check_order(t, 'strang', 1, 27, 315, 2)
        call check_order(t, 'strang', 2, 210, 2400, 2)
        call check_order(t, 'strang', 3, 210, 2400, 2)
        call check_order(t, 'yoshida4', 1, 27, 140, 4)
        call check_order(t, 'yoshida4', 2, 62, 210, 4)
        call check_order(t, 'yoshida4', 3, 140, 473, 4)
        call check_order(t, 'srkn6', 1, 62, 210, 4)
        call check_order(t, 'srkn6', 2, 315, 1065, 4)
        call check_order(t, 'srkn6', 3, 400, 1400, 4)
        call check_order(t, 's6', 1, 27, 140, 4)
        call check_order(t, 's6', 2, 62, 210, 4)
        call check_order(t, 's6', 3, 93, 315, 4)
        call check_order(t, 'srkn11', 1, 18, 41, 6)
        call check_order(t, 'srkn11', 2, 62, 140, 6)
        call check_order(t, 'srkn11', 3, 62, 140, 6)
        call check_order(t, 'srkn14', 1, 12, 27, 6)
        call check_order(t, 'srkn14', 2, 62, 140, 6)
        call check_order(t, 'srkn14', 3, 93, 210, 6)
        ! Small torque, or long steps: e^2 h^6 leads; then e^3 h^4 does, on the asymmetric top near rounding.
        call check_order(t, 'aba864', 1, 18, 41, 6)
        call check_order(t, 'aba864', 2, 41, 93, 6)
        call check_order(t, 'aba864', 2, 315, 1065, 4, compensated=.true.)
        call check_order(t, 'aba864', 3, 210, 710, 4)
    end subroutine test_orders

    subroutine check_order(t, name, number, few, many, order, compensated)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        integer, intent(in) :: number, few, many, order
        logical, intent(in), optional :: compensated
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        real(wp) :: m(3), q(4), error(2), seen
        character(1) :: digit
        integer :: i, n

        item = known_top(number)
        scheme = splitting_scheme(name)
        do i = 1, 2
            n = merge(few, many, i == 1)
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, item%t/n, n, m, q, compensated=compensated)
            error(i) = distance(m, q, item%m, item%q)
        end do
        seen = log(error(1)/error(2))/log(real(many, wp)/few)
        write (digit, '(i0)') number
        call t%close_to(name//'-shows-its-order-on-top-'//digit, seen, real(order, wp), 0.2_wp)
        call t%ok(name//'-error-falls-by-two-decades-on-top-'//digit, error(1) >= 100*error(2))
    end subroutine check_order

    !> The paper's run: T = 5e4 with h = 0.5.
    subroutine test_long_run(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: seen
        type(invariant_monitor) :: monitor
        real(wp) :: m(3), q(4), energy(1001), worst, trend
        integer :: stat, i, k
        logical :: stop_here

        item = known_top(1)
        scheme = splitting_scheme('srkn14')
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.5_wp, 100000, m, q, seen, every=100, stat=stat)
        call t%equal('papers-run-comes-to-its-end', stat, status_ok)
        call t%equal('observer-is-called-at-the-start-and-every-100-steps', seen%count, 1001)
        monitor%body = item%body
        allocate (monitor%scene, source=item%top)
        monitor%axis = item%top%force/sqrt(sum(item%top%force**2))
        do i = 1, seen%count
            energy(i) = total_energy(item%body, item%top, seen%t(i), seen%m(:, i), seen%q(:, i))
            call monitor%observe(seen%step(i), seen%t(i), seen%m(:, i), seen%q(:, i), stop_here)
        end do
        worst = largest(abs(energy - energy(1)))
        call t%at_most('energy-of-the-papers-top-stays-within-1e-13', worst, top_energy)
        call t%close_to('monitor-sees-the-same-energy-error', monitor%energy_error, worst, 0.0_wp)
        call t%at_most('momentum-about-the-force-stays-within-2e-13', monitor%momentum_error, 2.0e-13_wp)
        call t%at_most('norm-of-the-attitude-stays-within-2e-13', monitor%norm_error, 2.0e-13_wp)
        ! The straight line of best fit over the last nine tenths, the mean of four starts: rounding walks by
        ! 2e-14 or so in each of them, carried over it does not.
        trend = fitted_change(energy)
        do k = 1, 3
            m = item%m0*(1 + 0.001_wp*k)
            q = item%q0
            seen%count = 0
            call integrate(item%body, scheme, item%top, 0.5_wp, 100000, m, q, seen, every=100, stat=stat)
            energy = [(total_energy(item%body, item%top, seen%t(i), seen%m(:, i), seen%q(:, i)), i=1, 1001)]
            trend = trend + fitted_change(energy)
        end do
        call t%at_most('energy-error-has-no-trend', abs(trend)/4, 4.0e-14_wp)
        m = item%m0
        q = item%q0
        seen%count = 0
        call integrate(item%body, scheme, item%top, 0.5_wp, 100000, m, q, seen, every=100, compensated=.true.)
        energy = [(total_energy(item%body, item%top, seen%t(i), seen%m(:, i), seen%q(:, i)), i=1, 1001)]
        call t%at_most('compensated-energy-of-the-papers-top-stays-within-5e-14', &
                       largest(abs(energy - energy(1))), 5.0e-14_wp)
        call t%at_most('compensated-energy-error-has-no-trend', abs(fitted_change(energy)), 4.0e-15_wp)
    end subroutine test_long_run

    !> The torque of a heavy top is minus the change of its potential with a turn about each body axis.
    subroutine test_top_torque(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: small = 1.0e-5_wp    ! difference quotient: error small**2 and eps/small
        type(heavy_top) :: top
        real(wp) :: q(4), tau(3), slope(3), turn(4), v(2)
        integer :: j, stat(3)

        top = heavy_top(force=[0.3_wp, -0.7_wp, 1.1_wp], centre=[0.5_wp, 0.9_wp, -0.4_wp])
        q = [0.1_wp, 0.7_wp, 0.5_wp, 0.5_wp]
        call top%torque(q, 0.0_wp, tau, stat(1))
        do j = 1, 3
            turn = [cos(small/2), 0.0_wp, 0.0_wp, 0.0_wp]
            turn(1 + j) = sin(small/2)
            call top%potential(quat_product(q, turn), 0.0_wp, v(1), stat(2))
            call top%potential(quat_product(q, quat_conjugate(turn)), 0.0_wp, v(2), stat(3))
            slope(j) = (v(1) - v(2))/(2*small)
        end do
        call t%ok('a-heavy-top-refuses-nothing', all(stat == status_ok))
        call t%close_to('torque-of-a-heavy-top-is-minus-the-slope-of-its-potential', tau, -slope, 1.0e-9_wp)
    end subroutine test_top_torque

    !> What a symmetric top keeps, reversal, and the functions that tell.
    subroutine test_invariants(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(invariant_monitor) :: monitor
        type(heavy_top) :: top
        type(rigid_body) :: body
        type(spoilt_torque) :: no_potential
        real(wp) :: m(3), q(4), tensor(3, 3), h
        integer :: i, k

        body = rigid_body([1.0_wp, 1.0_wp, 0.5_wp])
        monitor%body = body
        allocate (monitor%scene, source=top)
        m = [0.3_wp, -0.2_wp, 2.0_wp]
        q = [0.8_wp, 0.6_wp, 0.0_wp, 0.0_wp]
        scheme = splitting_scheme('srkn14')
        call integrate(body, scheme, top, 0.02_wp, 500, m, q, monitor)
        call t%close_to('lagrange-top-keeps-its-momentum-about-its-own-axis', m(3), 2.0_wp, 64*eps)
        call t%at_most('lagrange-top-keeps-its-momentum-about-the-vertical', monitor%momentum_error, 256*eps)
        call t%at_most('lagrange-top-keeps-its-energy', monitor%energy_error, 256*eps)

        ! 10 000 steps there and back; compensated runs take ten times as long steps.
        do k = 1, 3
            item = known_top(k)
            h = merge(0.01_wp, 0.001_wp, k == 1)
            do i = 1, size(scheme_names)
                scheme = splitting_scheme(trim(scheme_names(i)))
                m = item%m0
                q = item%q0
                call integrate(item%body, scheme, item%top, h, 10000, m, q)
                call integrate(item%body, scheme, item%top, -h, 10000, m, q)
                call t%at_most(trim(scheme_names(i))//'-there-and-back-return-the-start', &
                               distance(m, q, item%m0, item%q0), reversed)
                m = item%m0
                q = item%q0
                call integrate(item%body, scheme, item%top, 10*h, 10000, m, q, compensated=.true.)
                call integrate(item%body, scheme, item%top, -10*h, 10000, m, q, compensated=.true.)
                call t%at_most(trim(scheme_names(i))//'-compensated-there-and-back-return-the-start', &
                               distance(m, q, item%m0, item%q0), reversed)
            end do
        end do
        ! T = 5000. |m| and energy of the drifts are kept, so what is left is the rounding where it turns.
        item = known_top(1)
        do i = 1, size(scheme_names)
            scheme = splitting_scheme(trim(scheme_names(i)))
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, 0.5_wp, 10000, m, q, compensated=.true.)
            call integrate(item%body, scheme, item%top, -0.5_wp, 10000, m, q, compensated=.true.)
            call t%at_most(trim(scheme_names(i))//'-papers-long-run-there-and-back-returns-the-start', &
                           distance(m, q, item%m0, item%q0), 2.0e-13_wp)
        end do

        tensor = 0.0_wp
        tensor(1, 1) = 3.0_wp
        tensor(2, 2) = 2.0_wp
        tensor(3, 3) = 2.0_wp
        tensor(2, 3) = 1.0_wp
        tensor(3, 2) = 1.0_wp
        ! Inverse of the block (2, 1; 1, 2) is (2, -1; -1, 2)/3.
        call t%close_to('kinetic-energy-of-a-tensor-body-is-half-m-inverse-tensor-m', &
                        kinetic_energy(rigid_body(tensor), [3.0_wp, 1.0_wp, 2.0_wp]), 1.5_wp + 1.0_wp, 16*eps)
        call t%close_to('kinetic-energy-follows-the-order-of-the-moments', &
                        kinetic_energy(rigid_body([3.0_wp, 1.0_wp, 2.0_wp]), [3.0_wp, 1.0_wp, 2.0_wp]), &
                        3.0_wp, 4*eps)
        call t%close_to('spatial-momentum-of-a-half-turn', &
                        spatial_momentum([1.0_wp, 2.0_wp, 3.0_wp], [0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]), &
                        [1.0_wp, -2.0_wp, -3.0_wp], 0.0_wp)
        call t%close_to('norm-defect-of-a-long-quaternion', norm_defect([0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp]), &
                        1.0_wp, 0.0_wp)
        call t%close_to('norm-defect-sees-the-last-digit', norm_defect([1 + eps, 0.0_wp, 0.0_wp, 0.0_wp]), &
                        eps, eps**2)
        call t%ok('energy-without-a-potential-is-nan', &
                  ieee_is_nan(total_energy(item%body, no_potential, 0.0_wp, item%m0, item%q0)))
    end subroutine test_invariants

    !> Compensated runs: rounding errors are carried over, so none of them accumulate.
    subroutine test_compensated(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(invariant_monitor) :: monitor
        type(recorder) :: seen
        type(plain_drift) :: drift
        type(tilting_drift) :: tilting
        type(heavy_top) :: free_top
        type(rigid_body) :: body
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), m_seen(3), q_seen(4), start(3)
        integer :: k

        item = known_top(3)
        scheme = splitting_scheme('srkn14')
        monitor%body = item%body
        allocate (monitor%scene, source=item%top)
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.01_wp, 20000, m, q, monitor, compensated=.true.)
        call t%at_most('compensated-energy-does-not-wander', monitor%energy_error, compensated_energy*eps)
        call t%at_most('compensated-momentum-does-not-wander', monitor%momentum_error, 32*eps)
        call t%at_most('compensated-norm-does-not-wander', monitor%norm_error, 4*eps)

        do k = 1, 3
            item = known_top(k)
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, item%t/2000, 2000, m, q, compensated=.true.)
            call t%at_most('compensated-top-ends-where-the-taylor-series-does', &
                           distance(m, q, item%m, item%q), 32*eps)
            m_seen = item%m0
            q_seen = item%q0
            seen%count = 0
            call integrate(item%body, scheme, item%top, item%t/2000, 2000, m_seen, q_seen, seen, every=500, &
                           drift=drift, compensated=.true.)
            call t%at_most('watching-a-compensated-run-does-not-change-it', &
                           distance(m_seen, q_seen, m, q), 0.0_wp)
            call t%at_most('observer-sees-the-end-of-a-compensated-run-as-it-is-returned', &
                           distance(seen%m(:, 5), seen%q(:, 5), m, q), 0.0_wp)
        end do

        ! Drifts that move m far in the body: half a period each; and momenta whose squares overflow.
        free_top = heavy_top(force=[0.0_wp, 0.0_wp, 0.0_wp])
        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        start = [1.0_wp, 0.05_wp, 1.05_wp]
        motion = free_motion(body, start, item%q0)
        m = start
        q = item%q0
        call integrate(body, splitting_scheme('strang'), free_top, 0.5_wp*motion%period(), 200, m, q, &
                       compensated=.true.)
        call t%close_to('compensated-drifts-of-half-a-period-keep-the-norm-of-m', norm2(m), norm2(start), &
                        8*eps)
        call t%close_to('compensated-drifts-of-half-a-period-keep-the-energy', sum(m*m/body%moments()), &
                        sum(start*start/body%moments()), 16*eps)
        m_seen = start
        q_seen = item%q0
        call integrate(body, splitting_scheme('strang'), free_top, 0.5_wp*motion%period(), 200, m_seen, &
                       q_seen)
        call t%at_most('compensated-drifts-of-half-a-period-go-the-same-way', &
                       distance(m, q, m_seen, q_seen), 1.0e-10_wp)
        m = start
        q = item%q0
        call integrate(body, splitting_scheme('strang'), free_top, 0.3_wp, 20, m, q, compensated=.true.)
        do k = -200, 200, 400
            m_seen = start*10.0_wp**k
            q_seen = item%q0
            call integrate(body, splitting_scheme('strang'), free_top, 0.3_wp/10.0_wp**k, 20, m_seen, &
                           q_seen, compensated=.true.)
            call t%at_most('compensated-runs-take-momenta-of-any-size', &
                           distance(m, q, m_seen/10.0_wp**k, q_seen), 1.0e-13_wp)
        end do

        ! Its energy changes by 1e-7 a step: that is no rounding.
        item = known_top(2)
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 40, m, q, drift=tilting)
        m_seen = item%m0
        q_seen = item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 40, m_seen, q_seen, drift=tilting, &
                       compensated=.true.)
        call t%at_most('a-drift-that-does-not-keep-the-energy-is-left-as-it-is', &
                       distance(m_seen, q_seen, m, q), 256*eps)
    end subroutine test_compensated

    !> Observers, merged stages, plain scenes, drifts.
    subroutine test_loop(t)
        type(tally), intent(inout) :: t
        character(8), parameter :: names(2) = [character(8) :: 'srkn14', 'srkn11']
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: every_step, every_seventh
        type(plain_drift) :: same_drift
        type(plain_scene) :: plain
        real(wp) :: m(3, 5), q(4, 5), v(2)
        integer :: i, stat

        item = known_top(2)
        do i = 1, 2
            scheme = splitting_scheme(trim(names(i)))
            m = spread(item%m0, 2, 5)
            q = spread(item%q0, 2, 5)
            every_step%count = 0
            every_seventh%count = 0
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 1), q(:, 1))
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 2), q(:, 2), every_step)
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 3), q(:, 3), every_seventh, every=7)
            call t%close_to('watching-a-run-does-not-change-it', [m(:, 2), q(:, 2), m(:, 3), q(:, 3)], &
                            [m(:, 1), q(:, 1), m(:, 1), q(:, 1)], 0.0_wp)
            call t%ok('observer-sees-the-start-and-every-step', every_step%count == 41)
            call t%ok('observer-sees-the-start-and-every-seventh-step', every_seventh%count == 6 &
                      .and. all(every_seventh%step(1:6) == [integer(int64) :: 0, 7, 14, 21, 28, 35]))
            call t%close_to('observer-is-told-the-time', every_seventh%t(1:6), &
                            0.35_wp*[0, 1, 2, 3, 4, 5], 2*eps)
            call t%close_to('observer-sees-the-end-as-it-is-returned', &
                            [every_step%m(:, 41), every_step%q(:, 41)], [m(:, 1), q(:, 1)], 0.0_wp)
            call t%close_to('observer-sees-the-start-as-it-was-given', &
                            [every_step%m(:, 1), every_step%q(:, 1)], [item%m0, item%q0], 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 20, m(:, 4), q(:, 4))
            call t%at_most('observer-sees-what-a-shorter-run-returns', &
                           distance(every_step%m(:, 21), every_step%q(:, 21), m(:, 4), q(:, 4)), 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 20, m(:, 4), q(:, 4))
            call t%at_most('a-run-in-two-parts-is-the-run', &
                           distance(m(:, 4), q(:, 4), m(:, 1), q(:, 1)), 0.0_wp)
            call integrate(item%body, scheme, item%top, 0.05_wp, 40, m(:, 5), q(:, 5), drift=same_drift)
            call t%close_to('the-same-flow-as-a-drift-of-the-users-gives-the-same-run', [m(:, 5), q(:, 5)], &
                            [m(:, 1), q(:, 1)], 0.0_wp)
        end do

        plain = plain_scene(weight_torque, weight)
        m(:, 2) = item%m0
        q(:, 2) = item%q0
        call integrate(item%body, scheme, plain, 0.05_wp, 40, m(:, 2), q(:, 2))
        call t%at_most('plain-procedures-make-the-same-top', &
                       distance(m(:, 2), q(:, 2), m(:, 1), q(:, 1)), 128*eps)
        call plain%potential(item%q, 0.0_wp, v(1), stat)
        call item%top%potential(item%q, 0.0_wp, v(2), stat)
        call t%close_to('plain-potential-is-the-tops', &
                        v(1), v(2), 2*eps)
        plain = plain_scene(weight_torque)
        call plain%potential(item%q, 0.0_wp, v(1), stat)
        call t%ok('plain-scene-without-potential-says-nan', ieee_is_nan(v(1)))
        plain = plain_scene()
        call integrate(item%body, scheme, plain, 0.05_wp, 40, m(:, 2), q(:, 2), stat=stat)
        call t%equal('plain-scene-without-torque-is-refused', stat, status_bad_torque)

        every_step%count = 0
        m(:, 2) = item%m0
        call integrate(item%body, scheme, item%top, 0.05_wp, 0, m(:, 2), q(:, 2), every_step, stat=stat)
        call t%ok('no-steps-leave-the-state-and-show-the-start', stat == status_ok &
                  .and. every_step%count == 1 .and. all(abs(m(:, 2) - item%m0) <= 0.0_wp))
    end subroutine test_loop

    !> The torque of a unit weight on axis 3 in a field along space axis 3: (Q_32, -Q_31, 0).
    pure subroutine weight_torque(q, t, tau)
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)

        associate (unused_t => t)
        end associate
        tau = [2*(q(3)*q(4) + q(1)*q(2)), -2*(q(2)*q(4) - q(1)*q(3)), 0.0_wp]
    end subroutine weight_torque

    !> Q_33.
    pure function weight(q, t) result(v)
        real(wp), intent(in) :: q(4), t
        real(wp) :: v

        associate (unused_t => t)
        end associate
        v = 1 - 2*(q(2)**2 + q(3)**2)
    end function weight

    !> Each way a call can be wrong: the code, and the state untouched.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme, bad_scheme
        type(spoilt_torque) :: spoilt
        type(failing_drift) :: failing
        type(heavy_top) :: violent
        type(rigid_body) :: bad_body
        real(wp) :: nan, inf, m(3), q(4), time
        integer :: stat

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        item = known_top(2)
        scheme = splitting_scheme('srkn14')
        time = 3.0_wp

        m = item%m0
        q = item%q0
        spoilt%until = 0.0_wp
        call integrate(item%body, scheme, spoilt, 0.1_wp, 100, m, q, t=time, stat=stat)
        call refused('torque-that-is-nan', status_bad_torque)
        spoilt%until = 7.2_wp
        call ends_with_a_whole_step('torque-that-becomes-nan', scheme)
        call ends_with_a_whole_step('torque-that-becomes-nan-in-a-bab-scheme', splitting_scheme('srkn11'))
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, drift=failing, stat=stat)
        call refused('drift-that-fails', status_bad_option)
        call integrate(item%body, scheme, item%top, 0.0_wp, 5, m, q, t=time, stat=stat)
        call refused('zero-step', status_bad_time)
        call integrate(item%body, scheme, item%top, nan, 5, m, q, t=time, stat=stat)
        call refused('nan-step', status_bad_time)
        call integrate(item%body, scheme, item%top, inf, 5, m, q, t=time, stat=stat)
        call refused('infinite-step', status_bad_time)
        call integrate(item%body, scheme, item%top, 1.0e300_wp, 100, m, q, t=time, stat=stat)
        call refused('run-whose-end-overflows', status_bad_time)
        violent = heavy_top(force=[0.0_wp, 0.0_wp, 0.1_wp*huge(1.0_wp)], centre=[1.0_wp, 0.0_wp, 0.0_wp])
        call integrate(item%body, scheme, violent, 100.0_wp, 5, m, q, t=time, stat=stat)
        call refused('torque-that-makes-m-overflow', status_bad_torque)
        call integrate(item%body, scheme, item%top, 0.1_wp, -1, m, q, t=time, stat=stat)
        call refused('negative-number-of-steps', status_bad_count)
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, every=0, t=time, stat=stat)
        call refused('observing-every-zero-steps', status_bad_count)
        call integrate(bad_body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('body-never-made', status_bad_moments)
        bad_scheme = splitting_scheme([0.5_wp, 0.5_wp], [0.9_wp])
        call integrate(item%body, bad_scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('scheme-that-does-not-sum-to-one', status_bad_scheme)
        call integrate(item%body, splitting_scheme('none'), item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call refused('scheme-of-unknown-name', status_bad_option)
        m(2) = inf
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('infinite-momentum-is-refused', stat, status_bad_momentum)
        m = item%m0
        q = 0.0_wp
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('attitude-of-norm-zero-is-refused', stat, status_bad_attitude)
        q(3) = nan
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('nan-attitude-is-refused', stat, status_bad_attitude)
        q = item%q0
        time = nan
        call integrate(item%body, scheme, item%top, 0.1_wp, 5, m, q, t=time, stat=stat)
        call t%equal('nan-time-is-refused', stat, status_bad_time)

    contains

        !> A torque that is NaN from time 7.2 on ends a run in steps of 0.1 from 3 with step 41 or 42.
        subroutine ends_with_a_whole_step(what, scheme)
            character(*), intent(in) :: what
            type(splitting_scheme), intent(in) :: scheme
            type(spoilt_torque) :: torque
            real(wp) :: m_end(3), q_end(4), t_end, m_short(3), q_short(4), t_short
            integer :: done

            m_end = m
            q_end = q
            t_end = time
            torque%until = 7.2_wp
            call integrate(item%body, scheme, torque, 0.1_wp, 100, m_end, q_end, t=t_end, stat=stat)
            done = nint((t_end - time)/0.1_wp)
            m_short = m
            q_short = q
            t_short = time
            torque%until = huge(time)
            call integrate(item%body, scheme, torque, 0.1_wp, done, m_short, q_short, t=t_short)
            call t%ok(what//'-ends-the-run-with-the-last-whole-step', stat == status_bad_torque &
                      .and. (done == 41 .or. done == 42) .and. all(abs(m_end - m_short) <= 0.0_wp) &
                      .and. all(abs(q_end - q_short) <= 0.0_wp) .and. abs(t_end - t_short) <= 0.0_wp)
        end subroutine ends_with_a_whole_step

        subroutine refused(what, code)
            character(*), intent(in) :: what
            integer, intent(in) :: code

            call t%ok(what//'-is-refused-and-the-state-untouched', stat == code &
                      .and. all(abs(m - item%m0) <= 0.0_wp) .and. all(abs(q - item%q0) <= 0.0_wp) &
                      .and. abs(time - 3.0_wp) <= 0.0_wp)
        end subroutine refused

    end subroutine test_refused

end module frb_test_splitting
