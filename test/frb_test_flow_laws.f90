!> free_flow: the laws any flow of the free rigid body obeys, other names and other axes, agreement with the
!> steps of the paper.
module frb_test_flow_laws
    use frb_checks, only: tally, largest, worst_of
    use frb_flow_samples, only: sample, random_samples, advanced, made_finite, defect, diagonal, no_turn
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_rotations, only: matrix_to_quat, quat_product, quat_conjugate, quat_to_matrix
    implicit none
    private

    public :: test_flow_laws

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Largest difference over the random motions below: two steps, at most one orbit long each, bodies away
    !> from no special case.
    real(wp), parameter :: two_steps = 200*eps
    !> Largest difference of two calls that mean the same step.
    real(wp), parameter :: same_step = 16*eps
    !> Norms, energy, momentum in space after one step.
    real(wp), parameter :: on_the_orbit = 32*eps

contains

    subroutine test_flow_laws(t)
        type(tally), intent(inout) :: t
        type(sample), allocatable :: samples(:)

        call t%open_suite('flow-laws', 23)
        samples = random_samples(300)
        call check_flow(t, samples)
        call check_relabelling(t, samples)
        call check_ways(t, samples)
        call check_tensor(t, samples)
        call check_paper_steps(t, samples)
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

    !> Every way of calling gives the same motion; the norm of q, and a matrix that is no rotation, are kept.
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
                alone = worst_of(alone, [abs(made_finite(m) - state(1:3))])
                m = it%m
                a = quat_to_matrix(it%q)
                call free_flow(body, it%h, m, a)
                matrix = worst_of(matrix, [abs(made_finite([a]) - [quat_to_matrix(state(4:7))]), &
                             abs(made_finite(m) - state(1:3))*huge(1)])
                m = it%m
                a = matmul(shear, quat_to_matrix(it%q))
                call free_flow(body, it%h, m, a)
                sheared = worst_of(sheared, [abs(made_finite([a]) &
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
                many_alone = worst_of(many_alone, [abs(made_finite([m1 - m2, m3 - m4]))])
                do j = 1, 45
                    associate (other => samples(1 + mod(i + 7*j, size(samples))))
                        many = worst_of(many, [abs(made_finite([m2(:, j), q2(:, j)]) &
                                                    - advanced(it%moments, other%m, it%h, other%q)), &
                                   abs(made_finite([m4(:, j), q4(:, j)]) &
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
    !> 100 000 steps as well, where rounding must not add up.
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
                worst(1) = worst_of(worst(1), [abs(made_finite(m) - matmul(r, p))])
                worst(2) = worst_of(worst(2), [abs(made_finite(q) &
                                                    - quat_product(p_q, quat_conjugate(other%q)))])
                m = matmul(r, it%m)
                call free_flow(body, it%h, m, a)
                worst(3) = worst_of(worst(3), [abs(made_finite([a]) - [quat_to_matrix(q)])])
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
            worst(1) = largest(abs(made_finite(m) - matmul(body%axes(), p)))
            worst(2) = largest(abs(made_finite(q) - quat_product(p_q, turn)))
            orbit = defect(body%moments(), it%m, made_finite([matmul(m, body%axes()), &
                                                          quat_product(q, matrix_to_quat(body%axes()))]))
        end associate
        call t%at_most('tensor-body-over-long-runs-agrees-with-its-principal-body', &
                       largest(worst(1:2)), phase)
        call t%at_most('tensor-body-over-long-runs-stays-on-the-orbit', largest(orbit), gathered)
    end subroutine check_tensor

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

end module frb_test_flow_laws
