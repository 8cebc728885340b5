!> Derivatives of many steps: products of transitions, runs under torque, a motion at a time.
module frb_test_tangent_runs
    use frb_checks, only: tally, largest, worst_of
    use frb_flow_samples, only: stream, not_a_number, same_bits, no_turn, no_rotation
    use frb_free_flow, only: flow_tangent, rigid_body
    use frb_free_motion, only: free_motion
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_splitting_tangent, only: integrate_tangent
    use frb_status, only: status_bad_attitude, status_bad_count, status_bad_moments, status_bad_time, &
        status_bad_torque, status_not_offered
    use frb_tangent_cases, only: hat
    use frb_torque_cases, only: spoilt_torque
    implicit none
    private

    public :: test_tangent_runs

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Two roundings of a step of a few radians; measured: 6 eps at most, on 1.6 million steps.
    real(wp), parameter :: lane_bar = 16*eps

contains

    subroutine test_tangent_runs(t)
        type(tally), intent(inout) :: t

        call t%open_suite('tangent-runs', 30)
        call check_composition(t)
        call check_composition_in_lanes(t, '0.01', 0.01_wp, 1.0e-14_wp)
        call check_composition_in_lanes(t, '0.1', 0.1_wp, 5.0e-14_wp)
        call check_lengths_in_lanes(t)
        call check_mixed_lanes(t)
        call check_runs(t)
        call check_almost_aligned(t)
        call t%close_suite()
    end subroutine test_tangent_runs

    !> Om(m) of Phi^T Om(m') Phi = Om(m).
    pure function structure(m) result(x)
        real(wp), intent(in) :: m(3)
        real(wp) :: x(6, 6)

        x = 0.0_wp
        x(1:3, 4:6) = no_rotation
        x(4:6, 1:3) = -no_rotation
        x(4:6, 4:6) = hat(m)
    end function structure

    !> 1e5 steps of 0.01 against the symplectic structure and one step of 1000.
    subroutine check_composition(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: m0(3) = [0.5_wp, -0.7_wp, 0.6_wp]
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), phi(6, 6), product(6, 6), identity(6, 6), residual
        integer :: step

        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        m = m0
        q = no_turn
        identity = 0.0_wp
        do step = 1, 6
            identity(step, step) = 1.0_wp
        end do
        product = identity
        do step = 1, 100000
            call flow_tangent(body, 0.01_wp, m, q, phi)
            ! As increments: phi is close to 1, and a product of such matrices would round more than they do.
            product = product + matmul(phi - identity, product)
        end do
        residual = norm2(matmul(transpose(product), matmul(structure(m), product)) - structure(m0)) &
                   /norm2(product)**2
        call t%at_most('symplectic-after-1e5-steps', residual, 1.0e-14_wp)
        m = m0
        q = no_turn
        call flow_tangent(body, 1000.0_wp, m, q, phi)
        call t%at_most('1e5-steps-are-one', norm2(product - phi)/norm2(phi), 1.0e-11_wp)
    end subroutine check_composition

    !> The symplectic structure after 1e5 steps of h, in lanes. A rounding that all steps of a motion share
    !> shows here: with the triple rounded before its use, 2e-13 for steps of 0.1.
    subroutine check_composition_in_lanes(t, name, h, bar)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        real(wp), intent(in) :: h, bar
        integer, parameter :: n = 32, followed(3) = [1, 14, 32]
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: m0(3, n), m(3, n), q(4, n), phi(6, 6, n), product(6, 6, size(followed)), identity(6, 6)
        real(wp) :: residual
        integer :: step, i, k

        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        do i = 1, n
            m0(:, i) = random%direction()
            q(:, i) = no_turn
        end do
        m = m0
        identity = 0.0_wp
        do i = 1, 6
            identity(i, i) = 1.0_wp
        end do
        product = spread(identity, 3, size(followed))
        do step = 1, t%many(100000)
            call flow_tangent(body, h, m, q, phi)
            do k = 1, size(followed)
                product(:, :, k) = product(:, :, k) &
                                   + matmul(phi(:, :, followed(k)) - identity, product(:, :, k))
            end do
        end do
        residual = 0.0_wp
        do k = 1, size(followed)
            i = followed(k)
            residual = worst_of(residual, norm2(matmul(transpose(product(:, :, k)), &
                                                       matmul(structure(m(:, i)), product(:, :, k))) &
                                                - structure(m0(:, i)))/norm2(product(:, :, k))**2)
        end do
        call t%at_most('symplectic-after-1e5-steps-in-lanes-of-'//name, residual, bar)
    end subroutine check_composition_in_lanes

    !> Lanes against one body at a time, for steps of all lengths: from the first terms of the series to many
    !> doublings; whole blocks and parts of them, of one and of several lengths, in turn.
    subroutine check_lengths_in_lanes(t)
        type(tally), intent(inout) :: t
        integer, parameter :: numbers(4) = [32, 9, 31, 45], lengths = 120
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: h, moments(3), m1(3), q1(4), phi1(6, 6), worst(5)
        real(wp), dimension(3, maxval(numbers)) :: m0, m
        real(wp) :: q(4, maxval(numbers)), phi(6, 6, maxval(numbers))
        integer :: i, k, n
        logical :: zeros

        worst = 0.0_wp
        zeros = .true.
        do k = 1, lengths
            moments = random%triangle()
            body = rigid_body(cshift(moments, mod(k, 3)))
            h = minval(moments)*10.0_wp**(-3 + 4.0_wp*mod(37*k, lengths)/lengths)
            n = numbers(1 + mod(k, size(numbers)))
            do i = 1, n
                m(:, i) = random%direction()
                if (mod(k, 5) == 0) m(:, i) = random%log_uniform(-2.0_wp, 0.0_wp)*m(:, i)
                q(:, i) = no_turn
            end do
            m0 = m
            phi = -1.0_wp
            call flow_tangent(body, h, m(:, :n), q(:, :n), phi(:, :, :n))
            zeros = zeros .and. all(abs(phi(1:3, 4:6, :n)) <= 0.0_wp)
            do i = 1, n
                m1 = m0(:, i)
                q1 = no_turn
                call flow_tangent(body, h, m1, q1, phi1)
                worst = worst_of(worst, [norm2(m(:, i) - m1), norm2(q(:, i) - q1), &
                                         norm2(phi(1:3, 1:3, i) - phi1(1:3, 1:3))/norm2(phi1(1:3, 1:3)), &
                                         norm2(phi(4:6, 1:3, i) - phi1(4:6, 1:3))/norm2(phi1(4:6, 1:3)), &
                                         norm2(phi(4:6, 4:6, i) - phi1(4:6, 4:6))])
            end do
        end do
        call t%ok('momentum-in-lanes-does-not-depend-on-the-attitude', zeros)
        call t%at_most('momentum-in-lanes-is-that-of-one-body', worst(1), lane_bar)
        call t%at_most('attitude-in-lanes-is-that-of-one-body', worst(2), lane_bar)
        call t%at_most('J-in-lanes-is-that-of-one-body', worst(3), lane_bar)
        call t%at_most('W-in-lanes-is-that-of-one-body', worst(4), lane_bar)
        call t%at_most('E-in-lanes-is-that-of-one-body', worst(5), lane_bar)
    end subroutine check_lengths_in_lanes

    !> Bodies whose steps differ in length, some of them refused, against one body at a time.
    subroutine check_mixed_lanes(t)
        type(tally), intent(inout) :: t
        integer, parameter :: numbers(4) = [33, 64, 100, 1061]
        type(stream) :: random
        type(rigid_body) :: body
        real(wp), allocatable :: m(:, :), q(:, :), m0(:, :), q0(:, :), phi(:, :, :)
        real(wp) :: phi1(6, 6), worst(3)
        integer :: i, k, stat, code, expected
        logical :: agree

        worst = 0.0_wp
        agree = .true.
        body = rigid_body([0.6_wp, 1.0_wp, 0.8_wp])
        do k = 1, size(numbers)
            allocate (m(3, numbers(k)), q(4, numbers(k)), phi(6, 6, numbers(k)))
            do i = 1, numbers(k)
                m(:, i) = random%log_uniform(-2.0_wp, 1.0_wp)*random%direction()
                q(:, i) = [random%uniform(-1.0_wp, 1.0_wp), random%direction()]
                if (mod(i, 40) == 7) m(2, i) = not_a_number(i)
                if (mod(i, 40) == 8) q(:, i) = 0.0_wp
                if (mod(i, 40) == 9) m(:, i) = 0.0_wp
            end do
            m0 = m
            q0 = q
            call flow_tangent(body, 0.1_wp, m, q, phi, stat)
            expected = 0
            do i = 1, numbers(k)
                call flow_tangent(body, 0.1_wp, m0(:, i), q0(:, i), phi1, code)
                if (code > expected) expected = code
                if (any(mod(i, 40) == [7, 8])) then
                    agree = agree .and. all(abs(phi(:, :, i) - phi1) <= 0.0_wp) &
                            .and. same_bits(m(:, i), m0(:, i)) .and. same_bits(q(:, i), q0(:, i))
                else
                    worst = worst_of(worst, [norm2(m(:, i) - m0(:, i))/max(norm2(m0(:, i)), 0.01_wp), &
                                             norm2(q(:, i) - q0(:, i))/norm2(q0(:, i)), &
                                             norm2(phi(:, :, i) - phi1)/norm2(phi1)])
                end if
            end do
            agree = agree .and. stat == expected
            deallocate (m, q, phi)
        end do
        call t%at_most('momenta-of-mixed-lanes-are-those-of-one-body', worst(1), lane_bar)
        call t%at_most('attitudes-of-mixed-lanes-are-those-of-one-body', worst(2), lane_bar)
        call t%at_most('derivatives-in-mixed-lanes-are-those-of-one-body', worst(3), lane_bar)
        call t%ok('refused-bodies-in-mixed-lanes-stay', agree)
    end subroutine check_mixed_lanes

    !> Nearly principal axes: the rotation to principal axes changes the momentum by less than its rounding.
    !> |m| wanders and does not drift. See the suite `drifts`.
    subroutine check_almost_aligned(t)
        type(tally), intent(inout) :: t
        integer, parameter :: steps = 30000
        ! In units of 2^-53 sqrt(steps). Measured: 0.4 and 0.4; 17 with increments rounded as m is.
        real(wp), parameter :: walk = 4.0_wp
        type(rigid_body) :: body
        real(wp) :: m(3), n(3), q(4), phi(6, 6), jacobian(3, 3), before
        integer :: step

        body = rigid_body(reshape([0.2_wp, 0.0_wp, 1.0e-8_wp, 0.0_wp, 0.9_wp, 0.0_wp, 1.0e-8_wp, 0.0_wp, &
                                   1.0_wp], [3, 3]))
        m = [0.3_wp, 0.4_wp, 1.2_wp]
        n = m
        q = no_turn
        before = norm2(m)
        do step = 1, steps
            call flow_tangent(body, 0.02_wp, m, q, phi)
            call flow_tangent(body, 0.02_wp, n, jacobian)
        end do
        call t%at_most('with-axes-almost-aligned-the-momentum-does-not-drift', &
                       abs(norm2(m)/before - 1)/(0.5_wp*eps*sqrt(real(steps, wp))), walk)
        call t%at_most('nor-without-the-attitude', &
                       abs(norm2(n)/before - 1)/(0.5_wp*eps*sqrt(real(steps, wp))), walk)
    end subroutine check_almost_aligned

    !> Runs under torque: the derivative against differences, and its structure; a motion at a time.
    subroutine check_runs(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.5_wp, 0.85_wp, 1.0_wp], step = 1.0e-5_wp
        type(rigid_body) :: body
        type(free_motion) :: motion
        type(heavy_top) :: top
        type(spoilt_torque) :: spoilt
        type(splitting_scheme) :: scheme
        real(wp) :: m0(3), q0(4), m(3), q(4), phi(6, 6), differences(6, 6), ends(7, 2), move(6), residual, &
            time, other_q(4)
        integer :: k, side, code

        body = rigid_body(moments)
        scheme = splitting_scheme('srkn11')
        m0 = [0.3_wp, -0.6_wp, 0.4_wp]
        q0 = [0.8_wp, 0.0_wp, 0.6_wp, 0.0_wp]
        do k = 1, 6
            do side = 1, 2
                move = 0.0_wp
                move(k) = (3 - 2*side)*step
                m = m0 + move(1:3)
                q = quat_product(q0, [cos(0.5_wp*norm2(move(4:6))), sin(0.5_wp*step)/step*move(4:6)])
                call integrate(body, scheme, top, 0.1_wp, 30, m, q)
                ends(:, side) = [m, q]
            end do
            differences(1:3, k) = (ends(1:3, 1) - ends(1:3, 2))/(2*step)
            q = quat_product(quat_conjugate(ends(4:7, 2)), ends(4:7, 1))
            differences(4:6, k) = 2*q(2:4)/(2*step)
        end do
        m = m0
        q = q0
        time = 1.0_wp
        call integrate_tangent(body, scheme, top, 0.1_wp, 30, m, q, phi, time)
        call t%at_most('run-of-a-top-against-differences', norm2(phi - differences)/norm2(phi), 1.0e-8_wp)
        residual = norm2(matmul(transpose(phi), matmul(structure(m), phi)) - structure(m0))/norm2(phi)**2
        call t%at_most('run-of-a-top-is-symplectic', residual, 100*eps)
        call t%close_to('run-of-a-top-takes-its-time', [time], [4.0_wp], 8*eps)
        ends(:, 1) = [m, q]
        m = m0
        q = q0
        call integrate(body, scheme, top, 0.1_wp, 30, m, q)
        call t%close_to('run-of-a-top-is-that-of-integrate', ends(:, 1), [m, q], 40*eps)
        call integrate_tangent(body, scheme, top, 0.1_wp, -1, m, q, phi, stat=code)
        call t%equal('run-of-a-negative-number-of-steps', code, status_bad_count)
        call integrate_tangent(body, splitting_scheme('fg4'), top, 0.1_wp, 1, m, q, phi, stat=code)
        call t%equal('run-with-modified-kicks', code, status_not_offered)
        other_q = (1 + 2.0e-6_wp)*q
        call integrate_tangent(body, scheme, top, 0.1_wp, 1, m, other_q, phi, stat=code)
        call t%equal('run-from-a-quaternion-of-another-norm', code, status_bad_attitude)
        other_q = 2*q
        call integrate_tangent(body, scheme, top, 0.1_wp, 0, m, other_q, phi, stat=code)
        call t%equal('run-of-no-steps-from-a-quaternion-of-another-norm', code, status_bad_attitude)
        call integrate_tangent(rigid_body(-moments), scheme, top, 0.1_wp, 0, m, q, phi, stat=code)
        call t%equal('run-of-no-steps-of-no-body', code, status_bad_moments)
        time = huge(time)
        call integrate_tangent(body, scheme, top, 0.1_wp, 1, m, q, phi, time, code)
        call t%equal('run-from-a-time-beyond-all-limits', code, status_bad_time)
        call integrate_tangent(body, scheme, spoilt, 0.1_wp, 1, m, q, phi, stat=code)
        call t%equal('run-under-a-torque-beyond-all-limits', code, status_bad_torque)
        motion = free_motion(body, m0, q0)
        call motion%tangent(7.0_wp, phi)
        m = m0
        q = q0
        call flow_tangent(body, 7.0_wp, m, q, differences)
        call t%at_most('motion-at-a-time', largest([abs(phi - differences)]), 0.0_wp)
        motion = free_motion(body, m0, 0*q0)
        call motion%tangent(7.0_wp, phi, code)
        call t%equal('motion-that-could-not-be-made', code, status_bad_attitude)
        call t%at_most('motion-that-could-not-be-made-has-the-derivative-1', abs(norm2(phi)**2 - 6), 8*eps)
    end subroutine check_runs

end module frb_test_tangent_runs
