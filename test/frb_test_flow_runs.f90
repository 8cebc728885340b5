!> free_flow over many steps: growth of errors, also against the discrete Moser-Veselov method of order 10,
!> and conserved quantities over a million steps.
module frb_test_flow_runs
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: kept => kept_long
    use frb_double_dmv, only: dmv_body, new_dmv_body, dmv_steps
    use frb_flow_samples, only: stream, true_case, made_finite, no_turn, no_rotation
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp, unit_roundoff
    use frb_reference_cases, only: reference_case, score_momentum, score_attitude
    use frb_rotations, only: norm3, quat_rotate
    implicit none
    private

    public :: test_flow_runs

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: most_doublings = 10      !! 16 to 16384 steps

    !> Error of N steps of 16/N, mean square over the bodies, at most this times sqrt(N), in units of the
    !> inherent sensitivity of one step of 16. Measured: 0.09 (m) and 0.10 (q).
    real(wp), parameter :: growth = 0.3_wp
    !> Slope of log(error) against log(N) from 64 to 16384 steps: 1/2 for a random walk, 1 for a bias.
    !> Measured: 0.54 (m) and 0.46 (q).
    real(wp), parameter :: steepest = 0.7_wp
    !> Largest ratio to the error of the discrete Moser-Veselov method of order 10, where that error is
    !> rounding. Measured: 1.21 (m) and 1.06 (q).
    real(wp), parameter :: against_dmv = 2.0_wp
    !> Over 48 motions of 20 000 short steps, in units of the walk 2^-53 sqrt(steps): mean and furthest.
    !> Measured: 0.06 and 0.9.
    real(wp), parameter :: bias = 0.25_wp
    real(wp), parameter :: walk_length = 4.0_wp
    !> Drift of one motion in a long step, in units of 2^-53. Measured: 0.06 (m), 0.08 (q), 0.25 (energy).
    real(wp), parameter :: long_drift = 0.6_wp

contains

    subroutine test_flow_runs(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-runs', 26)
        call check_growth(t)
        call check_million(t)
        call check_bias(t)
        call t%close_suite()
    end subroutine test_flow_runs

    !> N steps of 16/N against the truth at 16.
    subroutine check_growth(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(reference_case) :: it
        type(rigid_body) :: body
        type(dmv_body) :: rival
        real(wp) :: moments(3), m(3), q(4), many_m(3, 33), many_q(4, 33)
        real(wp) :: free(2, 0:most_doublings), dmv(2, 0:most_doublings), batch(2, 0:most_doublings)
        real(wp) :: steps(0:most_doublings), slope(2)
        integer :: bodies, i, k, n, step

        bodies = t%many(50)
        free = 0.0_wp
        dmv = 0.0_wp
        batch = 0.0_wp
        do i = 1, bodies
            moments = random%triangle()
            it = true_case(moments, random%direction(), 16.0_wp)
            body = rigid_body(moments)
            rival = new_dmv_body(moments)
            do k = 0, most_doublings
                n = 16*2**k
                m = it%m0
                q = no_turn
                do step = 1, n
                    call free_flow(body, 16.0_wp/n, m, q)
                end do
                free(:, k) = free(:, k) + [score_momentum(it, made_finite(m)), &
                    score_attitude(it, made_finite(q))]**2
                m = it%m0
                q = no_turn
                call dmv_steps(rival, 10, 16.0_wp/n, n, m, q)
                dmv(:, k) = dmv(:, k) + [score_momentum(it, made_finite(m)), &
                    score_attitude(it, made_finite(q))]**2
                if (i > 4 .or. k > 6) cycle
                many_m = spread(it%m0, 2, 33)
                many_q = spread(no_turn, 2, 33)
                do step = 1, n
                    call free_flow(body, 16.0_wp/n, many_m, many_q)
                end do
                m = many_m(:, 17)
                q = many_q(:, 17)
                batch(:, k) = worst_of(batch(:, k), [score_momentum(it, made_finite(m)), &
                                                score_attitude(it, made_finite(q))])
            end do
        end do
        free = sqrt(free/bodies)
        dmv = sqrt(dmv/bodies)
        steps = [(16.0_wp*2**k, k=0, most_doublings)]
        call t%at_most('error-of-m-grows-as-the-root-of-the-steps', largest(free(1, :)/sqrt(steps)), growth)
        call t%at_most('error-of-q-grows-as-the-root-of-the-steps', largest(free(2, :)/sqrt(steps)), growth)
        call t%at_most('error-in-a-batch-grows-as-the-root-of-the-steps', &
                       largest([batch/spread(sqrt(steps), 1, 2)]), 4*growth)
        do i = 1, 2
            slope(i) = fitted_slope(log(steps(2:)), log(free(i, 2:)))
        end do
        call t%at_most('slope-of-the-error-of-m', slope(1), steepest)
        call t%at_most('slope-of-the-error-of-q', slope(2), steepest)
        ! At rounding level from h = 1/16 on: the method error is below 1e-18 there.
        call t%at_most('error-of-m-is-at-most-twice-that-of-moser-veselov', largest(free(1, 4:)/dmv(1, 4:)), &
                       against_dmv)
        call t%at_most('error-of-q-is-at-most-twice-that-of-moser-veselov', largest(free(2, 4:)/dmv(2, 4:)), &
                       against_dmv)
    end subroutine check_growth

    !> Slope of the straight line of least squares.
    pure function fitted_slope(x, y) result(slope)
        real(wp), intent(in) :: x(:), y(:)
        real(wp) :: slope

        slope = sum((x - sum(x)/size(x))*y)/sum((x - sum(x)/size(x))**2)
    end function fitted_slope

    !> 10^6 steps of 0.01: norms, energy, momentum in space; quaternion, matrix, momentum alone, batch. The
    !> first of these after 10^7 steps too.
    subroutine check_million(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.4_wp, 0.7_wp, 1.0_wp], m0(3) = [0.5_wp, -0.7_wp, 0.6_wp]
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), a(3, 3), m_alone(3), m_matrix(3), many_m(3, 1), many_q(4, 1)
        integer :: step, steps

        steps = t%many(1000000)
        body = rigid_body(moments)
        m = m0
        q = no_turn
        m_alone = m0
        do step = 1, steps
            call free_flow(body, 0.01_wp, m, q)
            call free_flow(body, 0.01_wp, m_alone)
        end do
        call t%at_most('norm-of-m-after-a-million-steps', abs(norm3(made_finite(m))/norm3(m0) - 1), kept)
        call t%at_most('norm-of-q-after-a-million-steps', abs(norm2(made_finite(q)) - 1), kept)
        call t%at_most('energy-after-a-million-steps', energy_change(moments, m0, made_finite(m)), kept)
        call t%at_most('momentum-in-space-after-a-million-steps', &
                       norm3(quat_rotate(made_finite(q), m) - m0)/norm3(m0), kept)
        call t%at_most('momentum-alone-is-the-same-after-a-million-steps', largest(abs(m_alone - m)), 0.0_wp)
        do step = steps + 1, 10*steps
            call free_flow(body, 0.01_wp, m, q)
        end do
        call t%at_most('norm-of-m-after-ten-million-steps', abs(norm3(made_finite(m))/norm3(m0) - 1), kept)
        call t%at_most('norm-of-q-after-ten-million-steps', abs(norm2(made_finite(q)) - 1), kept)
        call t%at_most('energy-after-ten-million-steps', energy_change(moments, m0, made_finite(m)), kept)
        m_matrix = m0
        a = no_rotation
        many_m(:, 1) = m0
        many_q(:, 1) = no_turn
        do step = 1, steps/10
            call free_flow(body, 0.01_wp, m_matrix, a)
            call free_flow(body, 0.01_wp, many_m, many_q)
        end do
        call t%at_most('matrix-stays-orthogonal-over-1e5-steps', &
                       largest([abs(matmul(transpose(a), a) - no_rotation)]), kept)
        call t%at_most('momentum-in-space-by-the-matrix-over-1e5-steps', &
                       norm3(matmul(a, m_matrix) - m0)/norm3(m0), kept)
        call t%at_most('norm-of-m-in-a-batch-over-1e5-steps', &
                       abs(norm3(made_finite(many_m(:, 1)))/norm3(m0) - 1), kept)
        call t%at_most('norm-of-q-in-a-batch-over-1e5-steps', abs(norm2(made_finite(many_q(:, 1))) - 1), kept)
    end subroutine check_million

    !> |change of the energy| relative to itself, from the increment of m.
    pure function energy_change(moments, m0, m) result(change)
        real(wp), intent(in) :: moments(3), m0(3), m(3)
        real(wp) :: change

        change = abs(sum((m - m0)*(m + m0)/moments)/sum(m0*m0/moments))
    end function energy_change

    !> Many motions. Over short steps the norms and the energy walk at random, without a common sign; over
    !> long steps they may drift, by a fraction of a rounding per step.
    subroutine check_bias(t)
        type(tally), intent(inout) :: t
        integer, parameter :: motions = 48
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: moments(3), m0(3), m(3), q(4), h, mean(3), furthest(3), drift(3)
        integer :: i, step, steps, reach

        steps = t%many(20000)
        do reach = 1, 2
            mean = 0.0_wp
            furthest = 0.0_wp
            do i = 1, motions
                moments = random%triangle()
                m0 = random%direction()
                h = random%log_uniform(-3.0_wp, -1.0_wp)
                if (reach == 2) h = 100*h
                body = rigid_body(moments)
                m = m0
                q = no_turn
                do step = 1, steps
                    call free_flow(body, h, m, q)
                end do
                drift = made_finite([sum((m - m0)*(m + m0))/2, (sum(q*q) - 1)/2, &
                                 sum((m - m0)*(m + m0)/moments)/sum(m0*m0/moments)/2])
                mean = mean + drift/motions
                furthest = worst_of(furthest, abs(drift))
            end do
            if (reach == 2) exit
            associate (walk => unit_roundoff*sqrt(real(steps, wp)))
                call t%at_most('norm-of-m-has-no-bias', abs(mean(1))/walk, bias)
                call t%at_most('norm-of-q-has-no-bias', abs(mean(2))/walk, bias)
                call t%at_most('energy-has-no-bias', abs(mean(3))/walk, bias)
                call t%at_most('norms-and-energy-walk-at-random', largest(furthest)/walk, walk_length)
            end associate
        end do
        call t%at_most('drift-of-the-norm-of-m-in-long-steps-is-below-a-rounding', &
                       furthest(1)/(unit_roundoff*steps), long_drift)
        call t%at_most('drift-of-the-norm-of-q-in-long-steps-is-below-a-rounding', &
                       furthest(2)/(unit_roundoff*steps), long_drift)
        call t%at_most('drift-of-the-energy-in-long-steps-is-below-a-rounding', &
                       furthest(3)/(unit_roundoff*steps), long_drift)
    end subroutine check_bias

end module frb_test_flow_runs
