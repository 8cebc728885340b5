!> free_flow: the laws any flow of the free rigid body obeys, other names and other axes, agreement with the
!> steps of the paper and with Taylor series, relative accuracy of small increments.
module frb_test_flow_laws
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: flow_largest
    use frb_flow_limits, only: tiny_limit, short_limit, middle_limit, square_limit, period_limit, &
        tiny_turn_limit, small_turn_limit, middle_turn_limit
    use frb_flow_samples, only: stream, true_case, advanced, settled, near_separatrix, defect, no_turn
    use frb_free_flow, only: free_flow, rigid_body
    use frb_inertia, only: body_core, core_from_moments
    use frb_kinds, only: wp, qp, has_quad
    use frb_matrix_step, only: frb_step
    use frb_quad_truth, only: taylor_flow
    use frb_quat_step, only: quat_step
    use frb_reference_cases, only: reference_case, score_momentum, score_attitude
    use frb_rotations, only: matrix_to_quat, norm3, quat_product, quat_conjugate, quat_rotate, quat_to_matrix
    implicit none
    private

    public :: test_flow_laws

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Largest difference over the random motions below: two steps, at most one orbit long each, bodies away
    !> from no special case.
    real(wp), parameter :: two_steps = 200*eps
    !> The same step in other words.
    real(wp), parameter :: same_step = 16*eps
    !> Norms, energy, momentum in space after one step.
    real(wp), parameter :: on_the_orbit = 32*eps
    !> Increments from the identity, relative to their own size.
    real(wp), parameter :: increments = 8*eps

    !> A motion and a step, for the checks over many of them.
    type :: sample
        real(wp) :: moments(3), m(3), q(4), h
    end type sample

contains

    subroutine test_flow_laws(t)
        type(tally), intent(inout) :: t
        type(sample) :: samples(300)
        type(stream) :: random
        integer :: i

        call t%open_suite('flow-laws', 32)
        do i = 1, size(samples)
            associate (it => samples(i))
                it%moments = [random%uniform(0.2_wp, 1.0_wp), random%uniform(0.2_wp, 1.0_wp), &
                              random%uniform(0.2_wp, 1.0_wp)]
                it%m = random%uniform(0.5_wp, 1.5_wp)*random%direction()
                it%q = [random%uniform(-1.0_wp, 1.0_wp), random%direction()]
                it%q = it%q/norm2(it%q)
                it%h = random%uniform(-4.0_wp, 4.0_wp)
                if (mod(i, 3) == 0) it%h = 0.1_wp*it%h
            end associate
        end do
        call check_flow(t, samples)
        call check_relabelling(t, samples)
        call check_ways(t, samples)
        call check_tensor(t, samples)
        call check_paper_steps(t, samples)
        if (t%provided(has_quad, 6, 'Taylor series, which need 30 digits')) call check_taylor(t)
        if (t%provided(has_quad, 3, 'increments, which need 30 digits')) call check_increments(t)
        call t%close_suite()
    end subroutine test_flow_laws

    !> Group law, reversal, invariants, continuity.
    subroutine check_flow(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp) :: whole(7), part(7), group, back, orbit(4), jump, last(7)
        integer :: i, j

        group = 0.0_wp
        back = 0.0_wp
        orbit = 0.0_wp
        jump = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                whole = advanced(it%moments, it%m, it%h, it%q)
                part = advanced(it%moments, it%m, 0.3_wp*it%h, it%q)
                part = advanced(it%moments, part(1:3), it%h - 0.3_wp*it%h, part(4:7))
                group = worst_of(group, [abs(part - whole)])
                part = advanced(it%moments, whole(1:3), -it%h, whole(4:7))
                back = worst_of(back, [abs(part - [it%m, it%q])])
                do j = -3, 5
                    orbit = worst_of(orbit, defect(it%moments, it%m, &
                                                   advanced(it%moments, it%m, it%h*10.0_wp**j)))
                end do
                if (mod(i, 20) /= 0) cycle
                last = advanced(it%moments, it%m, -50.0_wp, it%q)
                do j = -999, 1000
                    part = advanced(it%moments, it%m, 0.05_wp*j, it%q)
                    jump = worst_of(jump, [abs(part(4:7) - last(4:7))])
                    last = part
                end do
            end associate
        end do
        call t%at_most('two-steps-equal-one-step-of-their-sum', group, two_steps)
        call t%at_most('step-back-returns-the-start', back, two_steps)
        call t%at_most('attitude-stays-unit', orbit(1), on_the_orbit)
        call t%at_most('norm-of-the-momentum-is-constant', orbit(2), on_the_orbit)
        call t%at_most('energy-is-constant', orbit(3), on_the_orbit)
        call t%at_most('momentum-in-space-is-constant', orbit(4), on_the_orbit)
        ! A body turns at most by |m| h/I1 = 0.38 in 0.05, its quaternion by half of that.
        call t%at_most('quaternion-is-continuous-over-many-periods', jump, 0.2_wp)
    end subroutine check_flow

    !> Other names for the axes: every permutation, odd ones with a reflection made a rotation by a sign; half
    !> turns about the axes; time backwards.
    subroutine check_relabelling(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, &
                                                         2, 1, 3, 1, 3, 2, 3, 2, 1], [3, 6])
        real(wp) :: state(7), other(7), sense, names, halves, backwards, sign3(3)
        integer :: i, k

        names = 0.0_wp
        halves = 0.0_wp
        backwards = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                state = advanced(it%moments, it%m, it%h)
                do k = 2, 6
                    sense = merge(1.0_wp, -1.0_wp, k <= 3)
                    other = advanced(it%moments(orders(:, k)), sense*it%m(orders(:, k)), it%h)
                    names = worst_of(names, [abs(other - [sense*state(orders(:, k)), state(4), &
                                                           sense*state(4 + orders(:, k))])])
                end do
                do k = 1, 3
                    sign3 = -1.0_wp
                    sign3(k) = 1.0_wp
                    other = advanced(it%moments, sign3*it%m, it%h)
                    halves = worst_of(halves, [abs(other - [sign3*state(1:3), state(4), sign3*state(5:7)])])
                end do
                other = advanced(it%moments, -it%m, -it%h)
                backwards = worst_of(backwards, [abs(other - [-state(1:3), state(4:7)])])
            end associate
        end do
        call t%at_most('relabelled-axes-give-the-relabelled-motion', names, same_step)
        call t%at_most('half-turns-about-the-axes-turn-the-motion', halves, 0.0_wp)
        call t%at_most('turned-momentum-runs-the-motion-backwards', backwards, 0.0_wp)
    end subroutine check_relabelling

    !> Every way of calling gives the same motion; the norm of q and a matrix that is no rotation are carried.
    subroutine check_ways(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        type(rigid_body) :: body, bodies(45)
        real(wp) :: m(3), a(3, 3), state(7), alone, matrix, norm, sheared, many_alone, many
        real(wp) :: m1(3, 45), m2(3, 45), m3(3, 45), m4(3, 45), q2(4, 45), q4(4, 45)
        real(wp), parameter :: shear(3, 3) = reshape([2.0_wp, 0.3_wp, 0.0_wp, 0.0_wp, 1.0_wp, -0.7_wp, &
                                                      0.1_wp, 0.0_wp, 0.0_wp], [3, 3])
        integer :: i, j

        alone = 0.0_wp
        matrix = 0.0_wp
        norm = 0.0_wp
        sheared = 0.0_wp
        many_alone = 0.0_wp
        many = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                body = rigid_body(it%moments)
                state = advanced(it%moments, it%m, it%h, it%q)
                m = it%m
                call free_flow(body, it%h, m)
                alone = worst_of(alone, [abs(settled(m) - state(1:3))])
                m = it%m
                a = quat_to_matrix(it%q)
                call free_flow(body, it%h, m, a)
                matrix = worst_of(matrix, [abs(settled([a]) - [quat_to_matrix(state(4:7))]), &
                             abs(settled(m) - state(1:3))*huge(1)])
                m = it%m
                a = matmul(shear, quat_to_matrix(it%q))
                call free_flow(body, it%h, m, a)
                sheared = worst_of(sheared, [abs(settled([a]) &
                                                  - [matmul(shear, quat_to_matrix(state(4:7)))])])
                norm = worst_of(norm, [abs(advanced(it%moments, it%m, it%h, 4*it%q) &
                                            - [state(1:3), 4*state(4:7)])])
                if (mod(i, 6) /= 0) cycle
                do j = 1, 45
                    associate (other => samples(1 + mod(i + 7*j, size(samples))))
                        bodies(j) = rigid_body(other%moments)
                        m1(:, j) = other%m
                        q2(:, j) = other%q
                    end associate
                end do
                q4 = q2
                m2 = m1
                m3 = m1
                m4 = m1
                call free_flow(body, it%h, m1)
                call free_flow(body, it%h, m2, q2)
                call free_flow(bodies, it%h, m3)
                call free_flow(bodies, it%h, m4, q4)
                many_alone = worst_of(many_alone, [abs(settled([m1 - m2, m3 - m4]))])
                do j = 1, 45
                    associate (other => samples(1 + mod(i + 7*j, size(samples))))
                        many = worst_of(many, [abs(settled([m2(:, j), q2(:, j)]) &
                                                    - advanced(it%moments, other%m, it%h, other%q)), &
                                   abs(settled([m4(:, j), q4(:, j)]) &
                                              - advanced(other%moments, other%m, it%h, other%q))])
                    end associate
                end do
            end associate
        end do
        call t%at_most('momentum-alone-is-the-momentum-of-the-full-call-to-the-last-bit', alone, 0.0_wp)
        call t%at_most('matrix-and-quaternion-agree', matrix, same_step)
        call t%at_most('any-matrix-is-turned', sheared, 2*same_step)
        call t%at_most('norm-of-the-quaternion-is-carried-along', norm, 0.0_wp)
        call t%at_most('momenta-alone-are-those-of-the-full-batch-to-the-last-bit', many_alone, 0.0_wp)
        call t%at_most('batches-agree-with-one-by-one', many, same_step)
    end subroutine check_ways

    !> A body given by its tensor moves as the body with its principal moments does, seen in other axes; over
    !> 100 000 steps as well, with nothing gathering.
    subroutine check_tensor(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp), parameter :: gathered = 2.0e-13_wp     ! a random walk of 1e5 steps, with room
        real(wp), parameter :: phase = 5.0e-11_wp        ! the same, times the angle turned
        type(rigid_body) :: body, plain
        real(wp) :: r(3, 3), tensor(3, 3), m(3), q(4), a(3, 3), p(3), p_q(4), worst(3), orbit(4), turn(4)
        integer :: i, j

        worst = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i), other => samples(1 + mod(i, size(samples))))
                r = quat_to_matrix(other%q)
                tensor = matmul(r, matmul(diagonal(it%moments), transpose(r)))
                tensor = 0.5_wp*(tensor + transpose(tensor))
                body = rigid_body(tensor)
                plain = rigid_body(it%moments)
                p = it%m
                p_q = it%q
                call free_flow(plain, it%h, p, p_q)
                m = matmul(r, it%m)
                q = quat_product(it%q, quat_conjugate(other%q))
                a = quat_to_matrix(q)
                call free_flow(body, it%h, m, q)
                worst(1) = worst_of(worst(1), [abs(settled(m) - matmul(r, p))])
                worst(2) = worst_of(worst(2), [abs(settled(q) &
                                                    - quat_product(p_q, quat_conjugate(other%q)))])
                m = matmul(r, it%m)
                call free_flow(body, it%h, m, a)
                worst(3) = worst_of(worst(3), [abs(settled([a]) - [quat_to_matrix(q)])])
            end associate
        end do
        call t%at_most('tensor-body-moves-as-its-principal-body: m', worst(1), two_steps)
        call t%at_most('tensor-body-moves-as-its-principal-body: q', worst(2), two_steps)
        call t%at_most('tensor-body-turns-a-matrix-alike', worst(3), same_step)

        associate (it => samples(1), other => samples(2))
            r = quat_to_matrix(other%q)
            tensor = matmul(r, matmul(diagonal(it%moments), transpose(r)))
            body = rigid_body(0.5_wp*(tensor + transpose(tensor)))
            ! The same body to the last bit: LAPACK's moments and axes.
            plain = rigid_body(body%moments())
            turn = quat_conjugate(matrix_to_quat(body%axes()))
            p = it%m
            p_q = no_turn
            m = matmul(body%axes(), p)
            q = turn
            do j = 1, 100000
                call free_flow(body, 0.01_wp, m, q)
                call free_flow(plain, 0.01_wp, p, p_q)
            end do
            worst(1) = largest(abs(settled(m) - matmul(body%axes(), p)))
            worst(2) = largest(abs(settled(q) - quat_product(p_q, turn)))
            orbit = defect(body%moments(), it%m, settled([matmul(m, body%axes()), &
                                                          quat_product(q, matrix_to_quat(body%axes()))]))
        end associate
        call t%at_most('tensor-body-over-long-runs-agrees-with-its-principal-body', &
                       largest(worst(1:2)), phase)
        call t%at_most('tensor-body-over-long-runs-stays-on-the-orbit', largest(orbit), gathered)
    end subroutine check_tensor

    pure function diagonal(values) result(matrix)
        real(wp), intent(in) :: values(3)
        real(wp) :: matrix(3, 3)

        matrix = 0.0_wp
        matrix(1, 1) = values(1)
        matrix(2, 2) = values(2)
        matrix(3, 3) = values(3)
    end function diagonal

    !> The paper's exact steps, by other formulas throughout.
    subroutine check_paper_steps(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp) :: state(7), m(3), q(4), a(3, 3), worst(2)
        integer :: i

        worst = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                state = advanced(it%moments, it%m, it%h, it%q)
                call quat_step(m, q, it%h, it%moments, it%m, it%q)
                worst(1) = worst_of(worst(1), [abs(state - [m, q])])
                call frb_step(m, a, it%h, it%moments, it%m, quat_to_matrix(it%q))
                worst(2) = worst_of(worst(2), [abs(state(1:3) - m), &
                               abs(quat_to_matrix(state(4:7)) - a)])
            end associate
        end do
        call t%at_most('quat-step-agrees', worst(1), two_steps)
        call t%at_most('frb-step-agrees', worst(2), two_steps)
    end subroutine check_paper_steps

    !> Where the paper's steps are at their worst: next to axes, elongated, next to symmetric and to the
    !> separatrix; and seven steps of one to fifty decay times that once had errors of 7 units and more.
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
        integer :: kind, i, j, count

        random%state = 41
        do kind = 1, 6
            count = merge(size(once, 2), each, kind == 6)
            do i = 1, count
                moments = random%triangle()
                m0 = random%direction()
                h = sign(random%log_uniform(-2.0_wp, 1.0_wp), random%uniform(-1.0_wp, 1.0_wp))
                select case (kind)
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
            call t%at_most('taylor-agrees: '//trim(names(kind)), &
                           largest([score_m(:count), score_q(:count)]), flow_largest)
        end do
    end subroutine check_taylor

    !> From the identity, small steps: vector part of q relative to its own size, and the component of m that
    !> starts at zero relative to itself. Steps on both sides of each limit of the formulas: the same, or the
    !> score when the turn is no longer small. One body and a batch.
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
                call raise(small, moments, m0, h, zero, both_ways(moments, m0, h))
            end do
            speed(1:5) = sqrt(fastest(moments, m0))
            speed(6:8) = spin
            do k = -1, 1, 2
                do j = 1, size(limits)
                    h = 2*sqrt(limits(j)*(1 + 1.0e-6_wp*k))/speed(j)
                    state = both_ways(moments, m0, h)
                    if (h*spin < small_turn) then
                        call raise(small, moments, m0, h, zero, state)
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
        state(:, 2) = settled([m(:, 7), q(:, 7)])
    end function both_ways

    !> Raises the largest relative errors so far, of the vector part of q and of m(zero), by those of a step.
    subroutine raise(worst, moments, m0, h, zero, state)
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
    end subroutine raise

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

end module frb_test_flow_laws
