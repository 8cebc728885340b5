!> One body under torque: published values, orders, long runs, invariants, compensated runs.
module frb_test_splitting
    use frb_checks, only: tally, largest
    use frb_claims, only: top_energy, compensated_energy, reversed
    use frb_free_flow, only: free_flow, rigid_body
    use frb_free_motion, only: free_motion
    use frb_invariants, only: invariant_monitor, kinetic_energy, norm_defect, spatial_momentum, total_energy
    use frb_kinds, only: wp
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme, scheme_names
    use frb_splitting, only: integrate
    use frb_status, only: status_ok
    use frb_torque_cases, only: top_case, known_top, papers_m_after_one_step, papers_m_at_5000, distance, &
        recorder, pulsed_torque, spoilt_torque, fitted_change, plain_drift, tilting_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: test_splitting

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_splitting(t)
        type(tally), intent(inout) :: t

        call t%open_suite('splitting', 183)
        call test_values(t)
        call test_orders(t)
        call test_long_run(t)
        call test_invariants(t)
        call test_reversal(t)
        call test_compensated(t)
        call test_compensated_drifts(t)
        call t%close_suite()
    end subroutine test_splitting

    !> Published values of the paper's example 1, end values by Taylor series, cases with a formula.
    subroutine test_values(t)
        type(tally), intent(inout) :: t
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
        call t%close_to('papers-top-after-one-step', m, papers_m_after_one_step, 4*eps)
        call integrate(item%body, scheme, item%top, 0.5_wp, 9999, m, q)
        ! The published run used the misprinted a_4.
        call t%close_to('papers-top-at-time-5000', m, papers_m_at_5000, 1.0e-8_wp)
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
        real(wp) :: m(3), q(4), error(2), order_seen
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
        order_seen = log(error(1)/error(2))/log(real(many, wp)/few)
        write (digit, '(i0)') number
        call t%close_to(name//'-shows-its-order-on-top-'//digit, order_seen, real(order, wp), 0.2_wp)
        call t%ok(name//'-error-falls-by-two-decades-on-top-'//digit, error(1) >= 100*error(2))
    end subroutine check_order

    !> The paper's run: T = 5e4 with h = 0.5.
    subroutine test_long_run(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(recorder) :: record
        type(invariant_monitor) :: monitor
        real(wp) :: m(3), q(4), energy(1001), worst, trend
        integer :: stat, i, k, steps
        logical :: stop_here

        steps = t%many(100000)
        item = known_top(1)
        scheme = splitting_scheme('srkn14')
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.5_wp, steps, m, q, record, every=steps/1000, &
                       stat=stat)
        call t%equal('papers-run-comes-to-its-end', stat, status_ok)
        call t%equal('observer-is-called-at-the-start-and-every-100-steps', record%count, 1001)
        monitor%body = item%body
        allocate (monitor%scene, source=item%top)
        monitor%axis = item%top%force/sqrt(sum(item%top%force**2))
        do i = 1, record%count
            energy(i) = total_energy(item%body, item%top, record%t(i), record%m(:, i), record%q(:, i))
            call monitor%observe(record%step(i), record%t(i), record%m(:, i), record%q(:, i), stop_here)
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
            record%count = 0
            call integrate(item%body, scheme, item%top, 0.5_wp, steps, m, q, record, every=steps/1000, &
                           stat=stat)
            energy = [(total_energy(item%body, item%top, record%t(i), record%m(:, i), record%q(:, i)), &
                       i=1, 1001)]
            trend = trend + fitted_change(energy)
        end do
        call t%at_most('energy-error-has-no-trend', abs(trend)/4, 4.0e-14_wp)
        m = item%m0
        q = item%q0
        record%count = 0
        call integrate(item%body, scheme, item%top, 0.5_wp, steps, m, q, record, every=steps/1000, &
                       compensated=.true.)
        energy = [(total_energy(item%body, item%top, record%t(i), record%m(:, i), record%q(:, i)), i=1, 1001)]
        call t%at_most('compensated-energy-of-the-papers-top-stays-within-5e-14', &
                       largest(abs(energy - energy(1))), 5.0e-14_wp)
        call t%at_most('compensated-energy-error-has-no-trend', abs(fitted_change(energy)), 4.0e-15_wp)
    end subroutine test_long_run

    !> Conserved quantities of a symmetric top, and the functions that compute them.
    subroutine test_invariants(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(invariant_monitor) :: monitor
        type(heavy_top) :: top
        type(rigid_body) :: body
        type(spoilt_torque) :: no_potential
        real(wp) :: m(3), q(4), tensor(3, 3)
        integer :: i
        logical :: stop_here

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

        item = known_top(1)
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
        deallocate (monitor%scene)
        allocate (monitor%scene, source=no_potential)
        do i = 0, 1
            call monitor%observe(int(i, int64), 0.0_wp, item%m0, item%q0, stop_here)
        end do
        call t%ok('monitor-tells-that-there-is-no-energy', ieee_is_nan(monitor%energy_error))
        call t%close_to('monitor-tells-the-other-errors', monitor%norm_error, abs(norm_defect(item%q0)), &
                        0.0_wp)
    end subroutine test_invariants

    !> Runs there and back return to their start, with every scheme, plain and compensated.
    subroutine test_reversal(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        real(wp) :: m(3), q(4), h
        integer :: i, k, steps

        ! 10 000 steps there and back; compensated runs with steps ten times as long.
        steps = t%many(10000)
        do k = 1, 3
            item = known_top(k)
            h = merge(0.01_wp, 0.001_wp, k == 1)
            do i = 1, size(scheme_names)
                scheme = splitting_scheme(trim(scheme_names(i)))
                m = item%m0
                q = item%q0
                call integrate(item%body, scheme, item%top, h, steps, m, q)
                call integrate(item%body, scheme, item%top, -h, steps, m, q)
                call t%at_most(trim(scheme_names(i))//'-there-and-back-return-the-start', &
                               distance(m, q, item%m0, item%q0), reversed)
                m = item%m0
                q = item%q0
                call integrate(item%body, scheme, item%top, 10*h, steps, m, q, compensated=.true.)
                call integrate(item%body, scheme, item%top, -10*h, steps, m, q, compensated=.true.)
                call t%at_most(trim(scheme_names(i))//'-compensated-there-and-back-return-the-start', &
                               distance(m, q, item%m0, item%q0), reversed)
            end do
        end do
        ! T = 5000. Drifts keep |m| and the energy, so only rounding in the kicks changes the energy.
        item = known_top(1)
        do i = 1, size(scheme_names)
            scheme = splitting_scheme(trim(scheme_names(i)))
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, 0.5_wp, steps, m, q, compensated=.true.)
            call integrate(item%body, scheme, item%top, -0.5_wp, steps, m, q, compensated=.true.)
            call t%at_most(trim(scheme_names(i))//'-papers-long-run-there-and-back-returns-the-start', &
                           distance(m, q, item%m0, item%q0), 2.0e-13_wp)
        end do
    end subroutine test_reversal

    !> Compensated runs: rounding errors are carried over, so none of them accumulate.
    subroutine test_compensated(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(invariant_monitor) :: monitor
        type(recorder) :: record
        type(plain_drift) :: drift
        real(wp) :: m(3), q(4), m_seen(3), q_seen(4)
        integer :: k

        item = known_top(3)
        scheme = splitting_scheme('srkn14')
        monitor%body = item%body
        allocate (monitor%scene, source=item%top)
        m = item%m0
        q = item%q0
        call integrate(item%body, scheme, item%top, 0.01_wp, t%many(20000), m, q, monitor, &
                       compensated=.true.)
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
            record%count = 0
            call integrate(item%body, scheme, item%top, item%t/2000, 2000, m_seen, q_seen, record, &
                           every=500, drift=drift, compensated=.true.)
            call t%at_most('watching-a-compensated-run-does-not-change-it', &
                           distance(m_seen, q_seen, m, q), 0.0_wp)
            call t%at_most('observer-sees-the-end-of-a-compensated-run-as-it-is-returned', &
                           distance(record%m(:, 5), record%q(:, 5), m, q), 0.0_wp)
        end do
    end subroutine test_compensated

    !> Compensated runs with unusual drifts: each moves m half a period, or does not keep the energy; and
    !> momenta whose squares overflow.
    subroutine test_compensated_drifts(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(tilting_drift) :: tilting
        type(heavy_top) :: free_top
        type(rigid_body) :: body
        type(free_motion) :: motion
        real(wp) :: m(3), q(4), m_other(3), q_other(4), start(3)
        integer :: k

        item = known_top(3)
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
        m_other = start
        q_other = item%q0
        call integrate(body, splitting_scheme('strang'), free_top, 0.5_wp*motion%period(), 200, m_other, &
                       q_other)
        call t%at_most('compensated-drifts-of-half-a-period-go-the-same-way', &
                       distance(m, q, m_other, q_other), 1.0e-10_wp)
        m = start
        q = item%q0
        call integrate(body, splitting_scheme('strang'), free_top, 0.3_wp, 20, m, q, compensated=.true.)
        do k = -200, 200, 400
            m_other = start*10.0_wp**k
            q_other = item%q0
            call integrate(body, splitting_scheme('strang'), free_top, 0.3_wp/10.0_wp**k, 20, m_other, &
                           q_other, compensated=.true.)
            call t%at_most('compensated-runs-take-momenta-of-any-size', &
                           distance(m, q, m_other/10.0_wp**k, q_other), 1.0e-13_wp)
        end do

        ! A step of this drift changes the energy by 1e-7, far more than rounding.
        item = known_top(2)
        m = item%m0
        q = item%q0
        call integrate(item%body, splitting_scheme('srkn14'), item%top, 0.05_wp, 40, m, q, drift=tilting)
        m_other = item%m0
        q_other = item%q0
        call integrate(item%body, splitting_scheme('srkn14'), item%top, 0.05_wp, 40, m_other, q_other, &
                       drift=tilting, compensated=.true.)
        call t%at_most('a-drift-that-does-not-keep-the-energy-is-left-as-it-is', &
                       distance(m_other, q_other, m, q), 256*eps)
    end subroutine test_compensated_drifts

end module frb_test_splitting
