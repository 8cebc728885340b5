!> free_flow against Taylor series in quadruple precision: random motions, relative accuracy of small
!> increments.
module frb_test_flow_accuracy
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: flow_largest
    use frb_flow_limits, only: tiny_limit, short_limit, middle_limit, square_limit, period_limit, &
        tiny_turn_limit, small_turn_limit, middle_turn_limit
    use frb_flow_samples, only: stream, true_case, advanced, made_finite, near_separatrix, no_turn
    use frb_free_flow, only: free_flow, rigid_body
    use frb_inertia, only: body_core, core_from_moments
    use frb_kinds, only: wp, qp, has_quad
    use frb_quad_truth, only: taylor_flow
    use frb_reference_cases, only: reference_case, score_momentum, score_attitude
    use frb_rotations, only: norm3
    implicit none
    private

    public :: test_flow_accuracy

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Increments from the identity, relative to their own size.
    real(wp), parameter :: increments = 8*eps

contains

    subroutine test_flow_accuracy(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-accuracy', 9)
        if (t%provided(has_quad, 6, 'Taylor series, which need 30 digits')) call check_taylor(t)
        if (t%provided(has_quad, 3, 'increments, which need 30 digits')) call check_increments(t)
        call t%close_suite()
    end subroutine test_flow_accuracy

    !> Motions where the paper's steps have their largest errors: next to axes, elongated bodies, nearly
    !> symmetric bodies, next to the separatrix; and seven steps of one to fifty decay times, where errors of
    !> 7 units are easily made.
    subroutine check_taylor(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: once(7, 7) = reshape([ &
            2.0_wp, 3.0_wp, 6.0_wp, -0.06621994603936827_wp, -0.9963448054874001_wp, &
            -0.06556430300927552_wp, 26.184468825814623_wp, &
            2.0_wp, 3.0_wp, 6.0_wp, 0.0337359798620618_wp, -0.1397101507655284_wp, &
            -0.03340196025946713_wp, 176.52777489859366_wp, &
            0.30524496319388295_wp, 0.8205737398334657_wp, 1.0_wp, -0.009994241528786883_wp, 1.0_wp, &
            0.00033931735038399526_wp, 6.674305074522667_wp, &
            0.22283323875575034_wp, 0.8329113751104621_wp, 1.0_wp, -0.002535894772202807_wp, 1.0_wp, &
            -0.009673119336817596_wp, 5.144967454629558_wp, &
            0.540808557902738_wp, 0.8201627959823994_wp, 1.0_wp, 0.0764155383865039_wp, &
            0.9899318900256034_wp, 0.1191449478720654_wp, 12.978298109014656_wp, &
            0.26606743444970626_wp, 0.8934391595400426_wp, 1.0_wp, -2.8857832288636798e-10_wp, &
            1.246920304276382_wp, 1.5188103500465105e-9_wp, -46.60886974674705_wp, &
            0.560336122957095_wp, 0.646569329870255_wp, 1.0_wp, -0.0208151442977459e-5_wp, &
            1.6708030352956845_wp, -0.015222141086047077e-5_wp, 46.452279510807774_wp], [7, 7])
        character(*), parameter :: names(6) = [character(20) :: 'next-to-an-axis', 'elongated', &
                                               'nearly-symmetric', 'next-to-separatrix', 'any-body', &
                                               'once-in-error']
        integer, parameter :: each = 25
        type(stream) :: random
        type(reference_case) :: it
        real(wp) :: moments(3), m0(3), h, state(7), score_m(each), score_q(each)
        integer :: edge, i, j, count

        random%state = 41
        do edge = 1, 6
            count = merge(size(once, 2), each, edge == 6)
            do i = 1, count
                moments = random%triangle()
                m0 = random%direction()
                h = sign(random%log_uniform(-2.0_wp, 1.0_wp), random%uniform(-1.0_wp, 1.0_wp))
                select case (edge)
                case (1)
                    j = 1 + mod(i, 3)
                    m0 = m0*random%log_uniform(-12.0_wp, -0.5_wp)
                    m0(j) = 1.0_wp
                case (2)
                    moments = [random%log_uniform(-6.0_wp, 0.0_wp), random%log_uniform(-1.0_wp, 0.0_wp), &
                               1.0_wp]
                    h = h*minval(moments)
                case (3)
                    j = 1 + mod(i, 3)
                    moments(j) = moments(1 + mod(j, 3))*(1 + random%log_uniform(-16.0_wp, -2.0_wp))
                case (4)
                    m0 = near_separatrix(random, moments, random%log_uniform(-15.0_wp, -1.0_wp))
                case (6)
                    moments = once(1:3, i)
                    m0 = once(4:6, i)
                    h = once(7, i)
                case default
                end select
                it = true_case(moments, m0, h)
                state = advanced(moments, m0, h)
                score_m(i) = score_momentum(it, state(1:3))
                score_q(i) = score_attitude(it, state(4:7))
            end do
            call t%at_most('taylor-agrees: '//trim(names(edge)), &
                           largest([score_m(:count), score_q(:count)]), flow_largest)
        end do
    end subroutine check_taylor

    !> Small steps from the identity: error of the vector part of q, and of the component of m that starts at
    !> zero, each relative to its own size. Steps on both sides of each limit of the formulas: the same
    !> errors, or the score when the turn is not small. One body and a batch.
    subroutine check_increments(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: limits(8) = [tiny_limit, short_limit, middle_limit, square_limit, &
                                            period_limit, tiny_turn_limit, small_turn_limit, &
                                            middle_turn_limit]
        real(wp), parameter :: small_turn = 0.5_wp
        type(stream) :: random
        type(reference_case) :: it
        real(wp) :: moments(3), m0(3), speed(8), spin, h, small(2), score, state(7, 2)
        integer :: i, j, k, zero

        small = 0.0_wp
        score = 0.0_wp
        do i = 1, 12
            moments = random%triangle()
            if (mod(i, 4) == 0) moments = moments(2)*(1 + [0.0_wp, 1.0e-3_wp, 1.5e-3_wp])
            if (mod(i, 4) == 1) moments(1) = 0.1_wp*moments(1)
            m0 = random%direction()
            zero = 1 + mod(i, 3)
            m0(zero) = 0.0_wp
            spin = norm3(m0)/minval(moments)
            do j = 0, 24
                h = 10.0_wp**(-8.0_wp + 0.25_wp*j)/spin
                call update_worst(small, moments, m0, h, zero, both_ways(moments, m0, h))
            end do
            speed(1:5) = sqrt(fastest(moments, m0))
            speed(6:8) = spin
            do k = -1, 1, 2
                do j = 1, size(limits)
                    h = 2*sqrt(limits(j)*(1 + 1.0e-6_wp*k))/speed(j)
                    state = both_ways(moments, m0, h)
                    if (h*spin < small_turn) then
                        call update_worst(small, moments, m0, h, zero, state)
                    else if (h*spin < 40) then
                        it = true_case(moments, m0, h)
                        score = worst_of(score, [score_momentum(it, state(1:3, 1)), &
                                    score_attitude(it, state(4:7, 1)), &
                                    score_momentum(it, state(1:3, 2)), score_attitude(it, state(4:7, 2))])
                    end if
                end do
            end do
        end do
        call t%at_most('small-turns-keep-their-relative-accuracy', small(1), increments)
        call t%at_most('small-changes-of-m-keep-their-relative-accuracy', small(2), increments)
        call t%at_most('no-jump-across-the-limits-of-the-formulas', score, flow_largest)
    end subroutine check_increments

    !> The states after h of one body and of one in a batch.
    function both_ways(moments, m0, h) result(state)
        real(wp), intent(in) :: moments(3), m0(3), h
        real(wp) :: state(7, 2)
        real(wp) :: m(3, 33), q(4, 33)

        state(:, 1) = advanced(moments, m0, h)
        m = spread(m0, 2, 33)
        q = spread(no_turn, 2, 33)
        call free_flow(rigid_body(moments), h, m, q)
        state(:, 2) = made_finite([m(:, 7), q(:, 7)])
    end function both_ways

    !> Updates the largest relative errors, of the vector part of q and of m(zero), with those of a step.
    subroutine update_worst(worst, moments, m0, h, zero, state)
        real(wp), intent(inout) :: worst(2)
        real(wp), intent(in) :: moments(3), m0(3), h, state(7, 2)
        integer, intent(in) :: zero
        real(qp) :: m(3), q(4)
        integer :: way

        m = m0
        q = no_turn
        call taylor_flow(real(moments, qp), real(h, qp), m, q)
        do way = 1, 2
            worst(1) = worst_of(worst(1), real(norm2(state(5:7, way) - q(2:4))/norm2(q(2:4)), wp))
            worst(2) = worst_of(worst(2), real(abs(state(zero, way)/m(zero) - 1), wp))
        end do
    end subroutine update_worst

    !> max(P, R) of a motion, from the differences of the moments of a sorted body.
    pure function fastest(moments, m) result(square)
        real(wp), intent(in) :: moments(3), m(3)
        real(wp) :: square
        type(body_core) :: body
        real(wp) :: x(3)

        body = core_from_moments(moments)
        x = m(body%order)**2
        square = max(body%gamma*(body%beta*x(1) + body%alpha*x(2)), &
                     body%alpha*(body%gamma*x(2) + body%beta*x(3)))
    end function fastest

end module frb_test_flow_accuracy
